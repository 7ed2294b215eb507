"""Fisher's scoring for noise levels: a step to where they are expected to be likeliest.

Slopes are those between the levels and their neighbours.  The information is that of innovations
``e`` of variance ``s``: the products of ``de / sqrt(s)`` and half of those of ``d ln s`` (Watson
and Engle, 1983), which is what neighbours change the whitened innovations and the logarithms of
their scales by.  Levels that change them alike stand in for each other, which steps level by level
do not see; and, other than the curvature of the likelihood, information is positive wherever the
search is.

What an innovation varies by is a sum of variances.  Where the slopes are to be trusted the step is
so taken in them: of what is twice too large one such step takes all, and one of its logarithm a
third, five of which a simulated flight needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.limits import LIMITS, LONGEST_STEP, USUAL_SIGMA
from onboard.core.filter.noise import ESTIMATED, NO_VARIANCES, USUAL, NoiseLevels, nudges
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain

SWEEPS = 200
"""Sweeps over the levels that a bounded step takes at the most: it is within a thousandth of a
level after some dozens, where levels trade [cost]."""
CLOSE = 1e-4
"""Log ratio that is not worth another sweep [cost]."""

TURNS = 8
"""Of a step in variances, whose logarithms are what is known beforehand: each halves what is left
of it and more [cost]."""
ENOUGH = 1e-2
"""Log ratio that is not worth another turn [cost]."""


@dataclass(frozen=True, slots=True)
class NoiseStep:
    """A step of the levels.

    Attributes:
        levels: where it ends.
        gain: how much more log-likelihood, prior included, is expected there.
    """

    levels: NoiseLevels
    gain: float


def scoring_step(
    centre: NoiseLevels,
    rise: Array,
    trades: Array,
    names: Sequence[str] = ESTIMATED,
    *,
    in_variances: bool = False,
) -> NoiseStep:
    """Step to the expected top, inside the limits.

    Args:
        centre: where the step begins.
        rise: (n,) log-likelihood of its :func:`~onboard.core.filter.noise.neighbours`, less its.
        trades: (n, n) products of what they change the innovations by, as of
            :class:`~onboard.core.filter.passes.Pass`.
        names: the n levels.
        in_variances: whether the step is one of variances, else of logarithms.
    """
    here = np.array([getattr(centre, name) for name in names])
    off = np.log(here / np.array([getattr(USUAL, name) for name in names]))
    limits = np.array([LIMITS[name] for name in names])
    apart = nudges(centre, names)
    H = trades / np.outer(apart, apart)
    # A neighbour is not so near that its rise is the slope alone.
    slope = rise / apart + np.diag(H) * apart / 2.0
    low, high = np.clip(np.log(limits / here[:, None]), -LONGEST_STEP, LONGEST_STEP).T
    varies = np.array([in_variances and name not in NO_VARIANCES for name in names])

    def changed(step: Array) -> Array:
        # Half the relative change of a variance begins as its level's logarithm does.
        return np.where(varies, np.expm1(2.0 * step) / 2.0, step)

    def gained(step: Array) -> float:
        change = changed(step)
        prior = 0.5 * float(np.sum((off + step) ** 2 - off**2)) / USUAL_SIGMA**2
        return float(slope @ change - 0.5 * change @ H @ change) - prior

    step, gain = np.zeros(len(names)), 0.0
    for _ in range(TURNS if in_variances else 1):
        bend = np.where(varies, np.exp(2.0 * step), 1.0)
        known = np.eye(len(names)) / USUAL_SIGMA**2
        rest = bend * (slope - H @ changed(step)) - (off + step) / USUAL_SIGMA**2
        more = bounded(H * np.outer(bend, bend) + known, rest, low - step, high - step)
        # A variance bends so much over a long step that it may end lower than it began.
        while (higher := gained(step + more)) < gain and np.abs(more).max() >= ENOUGH:
            more = more / 2.0
        if higher < gain:
            break
        step, gain = step + more, higher
        if np.abs(more).max(initial=0.0) < ENOUGH:
            break
    found = centre
    for name, by in zip(names, np.exp(step).tolist(), strict=True):
        found = found.scaled(name, by)
    return NoiseStep(found, gain)


def bounded(H: Array, slope: Array, low: Array, high: Array) -> Array:
    """(n,) maximum of ``slope x - x H x / 2`` with ``low <= x <= high``.

    By turns along each coordinate, which converges for every ``H`` (n, n) that is positive
    semidefinite with a positive diagonal.
    """
    x = np.zeros(len(slope))
    loops = compiled_loops()
    if loops is not None:
        loops.bounded(plain(H), plain(slope), plain(low), plain(high), SWEEPS, CLOSE, x)
        return x
    for _ in range(SWEEPS):
        before = x.copy()
        for i in range(len(x)):
            x[i] += (slope[i] - H[i] @ x) / H[i, i]
            x[i] = min(max(x[i], low[i]), high[i])
        if np.abs(x - before).max(initial=0.0) < CLOSE:
            break
    return x
