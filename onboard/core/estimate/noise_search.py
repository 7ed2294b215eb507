"""The search for noise levels, pass by pass: a stencil, a line search along its step, and again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import FAR_LOG_RATIO, SETTLED_LOG_RATIO
from onboard.core.filter.noise import (
    ESTIMATED,
    NoiseLevels,
    distance,
    line_search,
    stencil,
    stepped,
)


class NoiseSearch:
    """Says which levels a filter bank should try next, and which are the best so far."""

    def __init__(self, rounds: int) -> None:
        """Take the number of passes, from the first on, that may begin a stencil."""
        self._rounds = rounds
        self._target: NoiseLevels | None = None
        self._moving: Sequence[str] = ESTIMATED
        self._far = False
        self._begun: NoiseLevels | None = None
        self._members: tuple[NoiseLevels, ...] | None = None

    @property
    def unfinished(self) -> bool:
        """Whether a search is under way, or the last one went so far that one more is due."""
        return self._far or self._target is not None

    def members(self, turn: int, levels: NoiseLevels) -> tuple[NoiseLevels, ...] | None:
        """Levels of the bank in pass number ``turn``; None: only those that hold now."""
        self._members = None
        self._begun = self._begun or levels
        if self._target is not None:
            self._members = line_search(levels, self._target)
        elif turn < self._rounds or self._far:
            self._members = stencil(levels, self._moving)
        return self._members

    def better(self, levels: NoiseLevels, log_likelihoods: Sequence[float]) -> NoiseLevels:
        """Levels from here on, from what the bank of :meth:`members` has shown."""
        target, self._target = self._target, None
        if self._members is None:
            return levels
        if target is not None:
            best = self._members[int(np.argmax(log_likelihoods))]
            self._far = self._went_far(levels, best)
            return best
        self._far = False
        found = stepped(levels, log_likelihoods, self._moving)
        self._moving = [
            name
            for name in self._moving
            if abs(np.log(getattr(found, name) / getattr(levels, name))) >= SETTLED_LOG_RATIO
        ]
        if distance(levels, found) >= SETTLED_LOG_RATIO:
            self._target = found
        return levels

    def _went_far(self, before: NoiseLevels, now: NoiseLevels) -> bool:
        """Whether a level that is larger than it was thought to be has moved much.

        One that becomes smaller than that is soon below all others, and matters no more.
        """
        moved = [(getattr(before, n), getattr(now, n), getattr(self._begun, n)) for n in ESTIMATED]
        return any(max(a, b) > c and abs(np.log(b / a)) > FAR_LOG_RATIO for a, b, c in moved)

    def settled(self, before: NoiseLevels, now: NoiseLevels) -> bool:
        """Whether there is nothing more to try, and the levels have not moved."""
        return self._target is None and distance(before, now) < SETTLED_LOG_RATIO
