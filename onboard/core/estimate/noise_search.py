"""The search for noise levels, pass by pass: a stencil, a line search along its step, and again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import WORTH_A_SEARCH
from onboard.core.filter.noise import NoiseLevels, line_search, stencil
from onboard.core.filter.noise_step import NoiseStep, newton_step
from onboard.core.maths.arrays import Array


class NoiseSearch:
    """Says which levels a filter bank should try next, and which are the best so far."""

    def __init__(self, *, settled: bool = False) -> None:
        """Take whether the levels stand, without a search."""
        self._step: NoiseStep | None = None
        self._members: tuple[NoiseLevels, ...] = ()
        self.settled = settled
        """Whether another step is expected to gain too little to be worth its passes."""

    def members(self, levels: NoiseLevels) -> tuple[NoiseLevels, ...]:
        """Levels of the next pass's bank, the first of them ``levels``."""
        if self.settled:
            self._members = (levels,)
        elif self._step is None:
            self._members = stencil(levels)
        else:
            self._members = line_search(levels, self._step.levels)
        return self._members

    def better(
        self, levels: NoiseLevels, log_likelihoods: Sequence[float], trades: Array
    ) -> NoiseLevels:
        """Levels from here on, from what the bank of :meth:`members` has shown.

        Args:
            levels: those that held.
            log_likelihoods: of the B members.
            trades: (B, B) as in :class:`~onboard.core.filter.passes.Pass`.
        """
        if self.settled:
            return levels
        if self._step is None:
            self._step = newton_step(levels, log_likelihoods, trades)
            self.settled = self._step.gain < WORTH_A_SEARCH
            return levels
        rise = np.array(log_likelihoods) - log_likelihoods[0]
        best, step, self._step = int(np.argmax(rise)), self._step, None
        # Where it rises by next to nothing along the step, another one is not worth it; nor where
        # it is the parabola that it was taken for, for then its top has been reached.
        reached = abs(float(rise[-1]) - step.gain) < WORTH_A_SEARCH and not step.cut
        self.settled = reached or float(rise[best]) < WORTH_A_SEARCH
        return self._members[best]
