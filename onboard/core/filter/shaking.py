"""How much the force shakes: what of it is between samples goes with how much of it there is.

Vibration, gusts and a controller at the edge of its gain shake a vehicle faster than a log or a
stream has samples.  What the autopilot had averaged, or had not, between two samples is then not
what a curve through them has: samples of something that scatters with a variance of ``s^2`` and is
another one at the next sample, a time ``h`` later, leave ``s^2 h^2`` of the velocity unknown at
each, ``s^2 h`` a second; and what a sensor or a filter makes of the shaking goes on for longer than
a sample.  How much that is, is a level that the flight tells (``shake`` of
:class:`~onboard.core.filter.noise.NoiseLevels`: its square is the time for which all that is seen
of the shaking is in error); when there is much of it and when there is none, the samples tell.

That a walk which is the same all along the flight does not do: two accelerometers of one board part
by 0.0004 m/s in two calm seconds of a flight and by 0.07 in two shaken ones.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from onboard.core.filter.limits import SHAKING_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array

TINY = float(np.finfo(float).tiny)
"""Not zero: of a time that is divided by."""


def shaken_between(segment: Segment, start: Array, end: Array) -> Array:
    """Integrals of the squared distance of the force from its mean of a second around it.

    Args:
        segment: samples.
        start: (K,) s, in order.
        end: (K,) s.

    Returns:
        (K, 3) along the body's axes, (m/s^2)^2 s.
    """
    so_far = squares_so_far(segment.t, segment.raw_s @ segment.R_bs.T)
    out = [np.interp(end, segment.t, c) - np.interp(start, segment.t, c) for c in so_far.T]
    return np.stack(out, axis=1)


def walk_of(levels: NoiseLevels, shaken: Array, duration: float) -> Array:
    """How fast the velocity walks while the force scatters by ``shaken``.

    Args:
        levels: of the noise.
        shaken: (3,) as of :func:`shaken_between`.
        duration: of that flight, s.

    Returns:
        (3,) density along the same axes, (m/s)^2/s.
    """
    out: Array = levels.force_walk**2 + levels.shake**2 * shaken / max(duration, TINY)
    return out


def walked(levels: NoiseLevels, segments: Iterable[Segment]) -> Array:
    """(3,) the same along the sensor's axes, on the mean of all segments."""
    shaken, duration = np.zeros(3), 0.0
    for s in segments:
        shaken += squares_so_far(s.t, s.raw_s)[-1]
        duration += float(s.t[-1] - s.t[0])
    return walk_of(levels, shaken, duration)


def squares_so_far(t: Array, x: Array) -> Array:
    """Integral, from the first sample to each, of the squared distance from the mean around it.

    Args:
        t: (n,) s.
        x: (n, k) samples.

    Returns:
        (n, k) unit of a sample squared times s.
    """
    half = SHAKING_S / 2.0
    low, high = np.maximum(t - half, t[0]), np.minimum(t + half, t[-1])
    whole = _integral(t, x)
    sums = [np.interp(high, t, c) - np.interp(low, t, c) for c in whole.T]
    mean = np.stack(sums, axis=1) / np.maximum(high - low, TINY)[:, None]
    return _integral(t, (x - mean) ** 2)


def _integral(t: Array, x: Array) -> Array:
    """(n, k) of samples (n, k) by trapezoids, from the first to each."""
    out = np.zeros_like(x)
    np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t)[:, None], axis=0, out=out[1:])
    return out
