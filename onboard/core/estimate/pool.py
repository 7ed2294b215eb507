"""What the variances of all directions of one flight have in common.

In one direction few blocks count, and their scatter (:mod:`~onboard.core.estimate.scatter`) is
itself uncertain.  So the variances of all directions of a flight are taken for draws from one
distribution (inverse chi-square, its centre and its width found from them), and each is shrunk
towards the centre by as much as it is uncertain: the moderated variances of Smyth (2004).  On a
flight whose noise is as the model says all directions become one, and on one that contradicts
itself each stands for itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.limits import CENTRES, FREEDOMS
from onboard.core.maths.arrays import Array

TINY = 1e-30
"""Not zero: of a sum that is divided by, or whose logarithm is taken."""


@dataclass(frozen=True, slots=True)
class Pool:
    """What variance the directions of one flight have: centre, and degrees of freedom of it."""

    variance: float = 1.0
    freedom: float = math.inf

    @classmethod
    def of(cls, ratio: Array, count: Array, least: float) -> Pool:
        """The likeliest centre and width, given the scatter in every direction.

        A ratio is then distributed as Fisher's F.  Of one below ``least`` only that is used: a
        noise level that is too high is no contradiction.

        Args:
            ratio: (k,) variance over what the sums say.
            count: (k,) blocks that count for it.
            least: the centre is no smaller.
        """
        if not np.any(ratio > least):
            return cls(least)
        centres = np.geomspace(least, float(ratio.max()), CENTRES)
        above = ratio > least
        seen = ratio[above] / centres[:, None]
        inside, below = _Counts(count[above]), _Counts(count[~above])
        chances = [_log_likelihood(seen, inside, below, centres, f, least) for f in FREEDOMS]
        i, j = np.unravel_index(int(np.argmax(chances)), (len(FREEDOMS), CENTRES))
        return cls(float(centres[j]), FREEDOMS[i])

    def moderated(self, ratio: float, count: float) -> tuple[float, float]:
        """A variance shrunk towards the centre by its own uncertainty, and its freedom."""
        if math.isinf(self.freedom):
            return self.variance, self.freedom
        total = self.freedom + count
        return (self.freedom * self.variance + count * ratio) / total, total


BELOW = np.geomspace(1e-3, 1.0, 24)
"""Shares of the least centre at which the density below it is summed."""


class _Counts:
    """How many blocks count, (k,), and what of a density depends on nothing else."""

    __slots__ = ("_front", "half", "n")

    def __init__(self, n: Array) -> None:
        self.n, self.half = n, 0.5 * n
        self._front = -np.array([math.lgamma(h) for h in self.half])

    def log_density(self, u: Array, freedom: float) -> Array:
        """Of Fisher's F with these and ``freedom`` degrees; of chi-square over n without end."""
        n, half, front = self.n, self.half, self._front
        if math.isinf(freedom):
            front = front + half * np.log(half)
            tail = half * u
        else:
            front = front + np.array([math.lgamma(h + 0.5 * freedom) for h in half])
            front += half * np.log(n / freedom) - math.lgamma(0.5 * freedom)
            tail = (half + 0.5 * freedom) * np.log1p(n * u / freedom)
        out: Array = front + (half - 1.0) * np.log(u) - tail
        return out


def _log_likelihood(
    seen: Array, inside: _Counts, below: _Counts, centres: Array, freedom: float, least: float
) -> Array:
    """Of ratios above ``least``, over each of the centres, (c, j), and of those below it: (c,)."""
    density = inside.log_density(seen, freedom)
    out: Array = np.sum(density - np.log(centres)[:, None], axis=1)
    u = BELOW[:, None] * (least / centres)[:, None, None]
    under = np.trapezoid(np.exp(below.log_density(u, freedom)) * u, np.log(BELOW), axis=1)
    out += np.log(np.maximum(under, TINY)).sum(axis=1)
    return out
