"""The search for noise levels, pass by pass: each tells how good the last step was, and goes on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from onboard.core.estimate.limits import WORTH_A_SEARCH
from onboard.core.filter.limits import SHARES
from onboard.core.filter.noise import (
    ESTIMATED,
    STATED,
    USUAL,
    NoiseLevels,
    between,
    log_prior,
    neighbours,
)
from onboard.core.filter.noise_step import scoring_step
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array


def usually_stated(batches: Iterable[Batch]) -> float | None:
    """Accuracy of a velocity that a receiver states in the mean of logarithms, m/s.

    None where it is always the same, or nothing: what goes with it is not told then.
    """
    said = [b.fixes.accuracy[b.trusted] for b in batches if len(b.fixes.accuracy)]
    stated = np.concatenate(said or [np.zeros(0)])
    stated = stated[np.isfinite(stated)]
    if len(np.unique(stated)) < 2:
        return None
    return float(np.exp(np.log(stated).mean()))


UNTOLD = tuple(name for name in ESTIMATED if name not in STATED)
"""Levels that a flight tells in which a receiver states nothing."""


def levels_told(
    levels: NoiseLevels, batches: Iterable[Batch]
) -> tuple[NoiseLevels, tuple[str, ...]]:
    """Where a search begins from ``levels``, and the names of those that the flight tells."""
    usually = usually_stated(batches)
    if usually is None:
        return levels, UNTOLD
    powers = {name: getattr(levels, name) or getattr(USUAL, name) for name in STATED}
    return replace(levels, **powers, usually_stated=usually), ESTIMATED


class NoiseSearch:
    """Says which levels a filter bank should try next."""

    def __init__(
        self, names: Sequence[str] = ESTIMATED, *, settled: bool = False, blind: bool = False
    ) -> None:
        """Take where it begins.

        Args:
            names: levels that the flight can say anything of.
            settled: whether the levels stand, without a search.
            blind: whether nothing is known of timing yet.  The first pass then finds that alone:
                what it is off by would pass for noise.
        """
        self._names = names
        self._before: NoiseLevels | None = None
        self._way: list[NoiseLevels] = []
        self._failed = False
        self._blind = blind and not settled
        self.settled = settled
        """Whether another step is expected to gain too little to be worth its pass."""

    def members(self, levels: NoiseLevels) -> tuple[NoiseLevels, ...]:
        """Levels of the next pass's bank, the first of them ``levels``."""
        if self.settled or self._blind:
            return (levels,)
        self._way = [] if self._before is None else between(self._before, levels, SHARES)
        return (levels, *self._way, *neighbours(levels, self._names))

    def better(
        self,
        levels: NoiseLevels,
        log_likelihoods: Sequence[float],
        trades: Array,
        *,
        elsewhere: bool = False,
    ) -> NoiseLevels:
        """Levels to go on with, from what the bank of :meth:`members` has shown.

        Args:
            levels: those of the first member.
            log_likelihoods: of the B members.
            trades: (B, B) as in :class:`~onboard.core.filter.passes.Pass`.
            elsewhere: whether this pass was about another linearisation than the one before, whose
                slopes have told the step.
        """
        if self.settled or self._blind:
            self._blind = False
            return levels
        near = 1 + len(self._way)
        rise = np.array(log_likelihoods) - log_likelihoods[0]
        likely = rise[:near] + [log_prior(tried, self._names) for tried in (levels, *self._way)]
        best = int(np.argmax(likely))
        if best:
            # The step was too long.  If no part of it was any good, then no other step will be,
            # unless it was told about a linearisation that is left: then another one may, once.
            nothing = best == 1
            self.settled = nothing and (self._failed or not elsewhere)
            self._failed, self._before = nothing, None
            return self._way[best - 1]
        # While the linearisation moves, what it was off by passes for noise that will be gone.
        step = scoring_step(
            levels, rise[near:], trades[near:, near:], self._names, in_variances=not elsewhere
        )
        self.settled = step.gain < WORTH_A_SEARCH
        self._before = levels
        return step.levels
