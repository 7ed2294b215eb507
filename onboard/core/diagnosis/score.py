"""One score for every hypothesis: how surprising it would be by chance to explain as much.

A hypothesis is so many unknowns more: an effect of the catalogue, a jump at some moment, timing, a
product of signals.  If it is not true, the fall of chi-square by them is chi-square distributed
with as many degrees of freedom (Wilks 1938), as often as it is looked for in different places.  The
score is ``-2 ln`` of that probability; like a fall of chi-square it grows with the flight, and it
charges some five for an unknown more.  What counts as found is one probability for a flight.

Where the variance is only estimated, from so many blocks as contradict each other, a ratio of
variances takes the place of chi-square (Fisher's F), and more is needed for the same surprise.  A
gain is then counted as the chi-square that is as surprising as it where the decision falls.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import inf, log

import numpy as np

from onboard.core.diagnosis.limits import FALSE_ALARM
from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import log_survival
from onboard.core.maths.student import log_survival_f
from onboard.core.physics.catalogue import kinds


def surprise(
    gain: float,
    unknowns: int,
    places: float = 1.0,
    variance: float = 1.0,
    freedom: float = inf,
) -> float:
    """``-2 ln`` of the probability that chance explains as much at one of the places.

    Args:
        gain: fall of chi-square.
        unknowns: by how many (at least 1).
        places: at how many it was looked for, of which this is the best.
        variance: of the data over what the sums say.
        freedom: degrees of freedom with which it is known.
    """
    if freedom < inf:
        variance /= _worth(unknowns, log(places), freedom)
    gain = max(gain, 0.0) / max(variance, 1.0)
    return -2.0 * (log_survival(gain, unknowns) + log(places))


def needed(
    unknowns: int, places: float = 1.0, variance: float = 1.0, freedom: float = inf
) -> float:
    """Fall of chi-square from which a hypothesis counts as found; arguments as of surprise."""
    if freedom < inf:
        variance /= _worth(unknowns, log(places), freedom)
    return max(variance, 1.0) * _certain(unknowns, -0.5 * least() - log(places))


class Peak:
    """A likelihood over moments, looked at closer where it is highest.

    Attributes:
        t: (n,) moments, s.
        gain: (n,) fall of chi-square at each.
        width: (n,) s for which each stands.
    """

    def __init__(self, t: Array, gain: Array, width: float | Array) -> None:
        """Take the moments."""
        self.t, self.gain = t, gain
        self.width: Array = np.broadcast_to(np.asarray(width, dtype=np.float64), t.shape)

    @property
    def best(self) -> float:
        """The likeliest moment, s."""
        return float(self.t[np.argmax(self.gain)])

    @property
    def spacing(self) -> float:
        """Between the closest of them, s."""
        return float(self.width.min())

    @property
    def sigma(self) -> float:
        """Standard deviation of the moment, s: of its posterior over all that were looked at."""
        weight = np.exp(0.5 * (self.gain - self.gain.max())) * self.width
        mean = np.average(self.t, weights=weight)
        spread = np.average((self.t - mean) ** 2, weights=weight)
        return float(np.sqrt(spread + self.spacing**2 / 12.0))

    def closer(self, t: Array, gain: Array, spacing: float) -> Peak:
        """With closer moments about the best one in the place of those among them.

        What is left of the flight when it is gone through is not quite the same each time, so all
        are counted from the best one, which is among both.
        """
        more = gain[np.argmin(np.abs(t - self.best))] - self.gain.max()
        far = (self.t < t.min() - 0.5 * spacing) | (self.t > t.max() + 0.5 * spacing)
        return Peak(
            np.concatenate([self.t[far], t]),
            np.concatenate([self.gain[far] + more, gain]),
            np.concatenate([self.width[far], np.full(len(t), spacing)]),
        )


def time_sigma(t: Array, gain: Array, spacing: float) -> float:
    """Standard deviation of a moment, s: of its posterior over those that were looked at.

    Args:
        t: (n,) moments, s.
        gain: (n,) fall of chi-square by a jump at each, over its variance.
        spacing: s between them; within it, it may be anywhere.
    """
    return Peak(t, gain, spacing).sigma


def least() -> float:
    """Score from which a hypothesis counts as found: all are asked (Bonferroni)."""
    return -2.0 * log(FALSE_ALARM / len(kinds()))


def _worth(unknowns: int, log_places: float, freedom: float) -> float:
    """Of a gain over an estimated variance, as chi-square: both at the decision (0 ... 1)."""
    at = -0.5 * least() - log_places
    estimated = _quantile(lambda f: log_survival_f(f, unknowns, freedom), at)
    return _certain(unknowns, at) / (unknowns * estimated)


@lru_cache(maxsize=256)
def _certain(unknowns: int, at: float) -> float:
    """Chi-square that is passed with the probability whose logarithm is ``at``."""
    return _quantile(lambda x: log_survival(x, unknowns), at)


def _quantile(log_tail: Callable[[float], float], at: float) -> float:
    """Where a falling logarithm of a probability is ``at``, to a thousandth."""
    high = 1.0
    while log_tail(high) > at:
        high *= 2.0
    low = 0.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if log_tail(middle) > at else (low, middle)
    return 0.5 * (low + high)
