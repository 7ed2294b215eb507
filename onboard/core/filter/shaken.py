"""What is shaken: how much the force scatters about its own mean of a fifth of a second.

Samples of a force that is smooth say all of it; of one that is shaken faster than they follow each
other, by rotors, gusts or an engine, they say it at some moments, and what is between is missed.
Were each sample independent of its neighbours, a velocity would walk by their variance times the
time between them.  So much of it is missed on a flight is a level of its own
(:mod:`onboard.core.filter.noise`); here is where in the flight, and along which axis, it would be.
A vehicle shakes a hundred times as much in a gust as in the calm after it.
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.limits import SHAKEN_LASTS_S, SHAKEN_MEAN_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.interpolation import straight


def shaken_between(segment: Segment, start: Array, end: Array) -> Array:
    """Variances of the velocity if all that shakes a segment were missed.

    Args:
        segment: samples.
        start: (K,) s, in order.
        end: (K,) s, later each.

    Returns:
        (K, 3) by body axes, (m/s)^2.
    """
    t, sums = segment.once(_shaken)
    middle, lasts = (start + end) / 2.0, end - start
    half = np.maximum(SHAKEN_LASTS_S, lasts) / 2.0
    low, high = np.maximum(middle - half, t[0]), np.minimum(middle + half, t[-1])
    inside = np.maximum(high - low, np.finfo(float).tiny)
    found = straight(t, sums, high) - straight(t, sums, low)
    out: Array = np.maximum(found, 0.0) * (lasts / inside)[:, None]
    return out


def shaken_density(segment: Segment) -> Array:
    """(3,) the same of the whole segment by body axes and second, (m/s^2)^2 s."""
    t, sums = segment.once(_shaken)
    out: Array = sums[-1] / max(t[-1] - t[0], np.finfo(float).tiny)
    return out


def walk_s(levels: NoiseLevels, segment: Segment) -> Array:
    """(3,) variance by which the velocity walks in a second of a segment, (m/s)^2, sensor axes."""
    out: Array = (segment.R_bs**2).T @ levels.walk_shaken(shaken_density(segment))
    return out


def _shaken(segment: Segment) -> tuple[Array, Array]:
    """Moments (n,), s, and what the velocity's variance (n, 3) would be since the first."""
    t, f = segment.t, segment.raw_s @ segment.R_bs.T
    n, half = len(t), SHAKEN_MEAN_S / 2.0
    if n < 3:  # no mean that one could scatter about
        return t, np.zeros((n, 3))
    # As many samples before as after: of a force that grows the mean is in the middle.
    reach = np.arange(n) - np.searchsorted(t, t - half)
    reach = np.minimum(reach, np.searchsorted(t, t + half, side="right") - 1 - np.arange(n))
    middle = np.clip(np.arange(n), 1, n - 2)
    reach = np.maximum(np.minimum(reach, np.minimum(middle, n - 1 - middle)), 1)
    first, last = middle - reach, middle + reach + 1
    count = (last - first)[:, None]
    # About a value of its own: sums of squares of a force that hardly changes cancel.
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(f - f[0], axis=0)])
    off = f[middle] - f[0] - (total[last] - total[first]) / count
    var = off**2 * count / (count - 1)
    h = np.diff(t)
    grown = (var[1:] + var[:-1]) / 2.0 * h[:, None] ** 2
    return t, np.concatenate([np.zeros((1, 3)), np.cumsum(grown, axis=0)])
