"""How far a push has come: what was read, what was written, what is left to do."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Progress:
    """Mutable notes of one transaction; names are those of the plan's six parameters."""

    values: dict[str, float] = field(default_factory=dict)
    """The six and the accelerometer's identifier as last read."""
    awaiting: set[str] = field(default_factory=set)
    """Asked for in this state and not answered yet."""
    queue: list[str] = field(default_factory=list)
    """Still to be written in this state, in a safe order."""
    written: set[str] = field(default_factory=set)
    """Sent at least once: from then on the new value is expected, not the old one."""
    foreign: dict[str, float] = field(default_factory=dict)
    """Values that were neither old nor new when the six were last read on the way back."""
    left: frozenset[str] = frozenset()
    """Somebody else's: a roll-back leaves them as they are."""
    turned: bool = False
    """It goes back to old from here on, also after a crash."""
    finishing: bool = False
    """A resumed transaction that needs nothing but to be read once more."""
    undo_unsaved: bool = False
    """An old value is in force again, but the autopilot does not say that it is stored."""
    axis_undone: bool = False
    """The axis that comes first has been written back in this round."""
    rounds: int = 0
    """How often the old values were written back."""

    def expected(self, name: str, before: float, wanted: float) -> float:
        """The value that a parameter should have on the way to new."""
        return wanted if name in self.written or self.finishing else before
