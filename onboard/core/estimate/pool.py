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
        inside = _Ratios(count[above], seen, -np.log(centres)[:, None])
        under = BELOW[:, None] * (least / centres)[:, None, None]
        below = _Ratios(count[~above], under, np.log(under * _WIDTHS[:, None]))
        chances = [_log_likelihood(inside, below, f) for f in FREEDOMS]
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


_APART = np.diff(np.log(BELOW), prepend=math.log(BELOW[0]), append=math.log(BELOW[-1]))
_WIDTHS = 0.5 * (_APART[:-1] + _APART[1:])
"""What each of them stands for in an integral over their logarithm, by trapezoids."""


class _Ratios:
    """Ratios ``u`` (..., k) for which so many blocks count, (k,): how dense they are.

    What does not change with the freedom is worked out once, ``more`` added to it.
    """

    __slots__ = ("_front", "_half", "_n", "_u")

    def __init__(self, n: Array, u: Array, more: Array) -> None:
        self._n, self._half, self._u = n, 0.5 * n, u
        front = self._half * np.log(n) - np.array([math.lgamma(h) for h in self._half])
        self._front = front + (self._half - 1.0) * np.log(u) + more

    def log_density(self, freedom: float) -> Array:
        """Of Fisher's F with these and ``freedom`` degrees; of chi-square over n without end."""
        half = self._half
        if math.isinf(freedom):
            out: Array = self._front - half * (math.log(2.0) + self._u)
            return out
        total = half + 0.5 * freedom
        front = np.array([math.lgamma(h) for h in total]) - math.lgamma(0.5 * freedom)
        out = np.log1p(self._n / freedom * self._u)
        out *= -total
        out += self._front
        out += front - half * math.log(freedom)
        return out


def _log_likelihood(inside: _Ratios, below: _Ratios, freedom: float) -> Array:
    """Of ratios above the least, over each of the centres, and of those below it: (c,)."""
    out: Array = inside.log_density(freedom).sum(axis=1)
    under = np.exp(below.log_density(freedom)).sum(axis=1)
    out += np.log(np.maximum(under, TINY)).sum(axis=1)
    return out
