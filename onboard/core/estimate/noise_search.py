"""The search for noise levels, pass by pass: a stencil, a line search along its step, and again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import WORTH_A_SEARCH
from onboard.core.filter.noise import NoiseLevels, line_search, stencil
from onboard.core.filter.noise_step import newton_step
from onboard.core.maths.arrays import Array


class NoiseSearch:
    """Says which levels a filter bank should try next, and which are the best so far."""

    def __init__(self, *, settled: bool = False) -> None:
        """Take whether the levels stand, without a search."""
        self._target: NoiseLevels | None = None
        self._members: tuple[NoiseLevels, ...] = ()
        self.settled = settled
        """Whether another step is expected to gain too little to be worth its passes."""

    def members(self, levels: NoiseLevels) -> tuple[NoiseLevels, ...]:
        """Levels of the next pass's bank, the first of them ``levels``."""
        if self.settled:
            self._members = (levels,)
        elif self._target is None:
            self._members = stencil(levels)
        else:
            self._members = line_search(levels, self._target)
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
        if self._target is not None:
            self._target = None
            return self._members[int(np.argmax(log_likelihoods))]
        step = newton_step(levels, log_likelihoods, trades)
        self.settled = step.gain < WORTH_A_SEARCH
        if not self.settled:
            self._target = step.levels
        return levels
