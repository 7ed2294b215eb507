"""Who answers on the link: the key of everything that was learned."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answers on the link; ``board`` is its unique id in hex, empty if it tells none.

    A board that tells its id is that one, whatever system id somebody has given it; of those that
    tell none the system id decides.
    """

    system_id: int
    autopilot: str = "ardupilot"
    board: str = ""

    def surely_not(self, other: Identity) -> bool:
        """Whether it is another one than ``other`` by its own word."""
        if self.board and other.board:
            return self.board != other.board
        return self.system_id != other.system_id

    def surely(self, other: Identity) -> bool:
        """Whether it is the same one by its own word, with the same kind of firmware."""
        return bool(self.board) and self.board == other.board and self.autopilot == other.autopilot
