"""How far a walk over a recording may go in one stride of numpy."""

from __future__ import annotations

from dataclasses import dataclass

SHORTEST, LONGEST = 1 << 12, 1 << 18
"""bytes"""
MOST_DECEPTIONS = 64
"""Places in one stride that look like the beginning of something but stand inside another thing."""


@dataclass(slots=True)
class Pace:
    """Lets strides grow while nothing stops them.

    After one that was stopped, some bytes are walked step by step, so that no file costs much more
    than such a walk, however it is made.
    """

    length: int = SHORTEST
    slow_until: int = 0

    def strides(self, at: int) -> bool:
        """Whether to try a stride from ``at``."""
        return at >= self.slow_until

    def took(self, end: int, *, whole: bool) -> None:
        """A stride came to ``end``; whether that is as far as it was to go."""
        if whole:
            self.length = min(2 * self.length, LONGEST)
        else:
            self.length, self.slow_until = SHORTEST, end + SHORTEST
