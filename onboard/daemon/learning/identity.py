"""Who answers on the link: the key of everything that was learned."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answers on the link; ``board`` is its unique id in hex, empty if it tells none."""

    system_id: int
    autopilot: str = "ardupilot"
    board: str = ""

    def surely_not(self, other: Identity) -> bool:
        """Whether it is another one than ``other`` by its own word."""
        if self.system_id != other.system_id:
            return True
        return bool(self.board and other.board) and self.board != other.board
