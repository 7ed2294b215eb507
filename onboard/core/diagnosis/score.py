"""One score for every hypothesis: how surprising it would be by chance to explain as much.

A hypothesis is so many unknowns more: an effect of the catalogue, a jump at some moment, timing, a
product of signals.  If it is not true, the fall of chi-square by them is chi-square distributed
with as many degrees of freedom (Wilks 1938), as often as it is looked for in different places.  The
score is ``-2 ln`` of that probability; like a fall of chi-square it grows with the flight, and it
charges some five for an unknown more.  What counts as found is one probability for a flight.
"""

from __future__ import annotations

from functools import lru_cache
from math import log

from onboard.core.diagnosis.limits import FALSE_ALARM
from onboard.core.maths.chi_square import log_survival
from onboard.core.physics.catalogue import kinds


def surprise(gain: float, unknowns: int, places: float = 1.0) -> float:
    """``-2 ln`` of the probability that chance explains as much at one of the places.

    Args:
        gain: fall of chi-square, in units of the variance there is.
        unknowns: by how many (at least 1).
        places: at how many it was looked for, of which this is the best.
    """
    return -2.0 * (log_survival(max(gain, 0.0), unknowns) + log(places))


@lru_cache(maxsize=256)
def needed(unknowns: int, places: float = 1.0) -> float:
    """Gain from which a hypothesis counts as found, to a thousandth; arguments as of surprise."""
    high = 1.0
    while surprise(high, unknowns, places) < least():
        high *= 2.0
    low = 0.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        found = surprise(middle, unknowns, places) >= least()
        low, high = (low, middle) if found else (middle, high)
    return high


def least() -> float:
    """Score from which a hypothesis counts as found: all are asked (Bonferroni)."""
    return -2.0 * log(FALSE_ALARM / len(kinds()))
