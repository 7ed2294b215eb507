"""Where a vehicle hit the ground without standing on it: a bounce is no flight, and no stand.

The ground pushes for milliseconds, of which samples of an accelerometer keep what they happen to
meet.  What the velocity jumps by is then no integral of the force, and a calibration or an airframe
that is fitted over it makes up for that: on a log of 25 samples a second by a seventh of the scale,
and a curve of it.  A plane that hops over a field on its wheels is held to its way by them: what
they push with would be a side force of its airframe, and lift.
"""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import GROUND_M, STILL_M_S
from onboard.core.maths.arrays import Array
from onboard.core.maths.spans import joined
from onboard.core.vehicle.limits import APART_FORCE_M_S2, MARGIN_S, OUTLYING, STILL_S


def touched_spans(
    t: Array, v_n: Array, height: Array, ground: float, times: Array, f_b: Array
) -> list[tuple[float, float]]:
    """Intervals (s) about bounces, with a margin to either side.

    At one a vehicle sinks, then climbs, no higher above the ground than a receiver's height
    wanders, and is shaken across its rotors, or along and across its wings, as air cannot do: a
    copter's drag is a quarter of the speed through the air, so that a step of
    :data:`APART_FORCE_M_S2` from one sample to the next would be a gust of six metres a second.  A
    plane's side force would have it of a gust of half a metre a second, at once: beside that it is
    further off than steps of this flight ever are by their scatter, which its gusts are in.

    Args:
        t: (n,) times of fixes, s.
        v_n: (n, 3) velocity, m/s; NaN down where it is not measured.
        height: (n,) m.
        ground: height of the ground, m.
        times: (m,) of the accelerometer, s.
        f_b: (m, 3) m/s^2.
    """
    if len(times) < 2 or len(t) < 2:
        return []
    steps = np.abs(np.diff(f_b[:, :2], axis=0))
    usual = 1.4826 * np.median(steps, axis=0)
    shaken = np.any(steps > np.maximum(OUTLYING * usual, APART_FORCE_M_S2), axis=1)
    out: list[tuple[float, float]] = []
    for at in times[1:][shaken].tolist():
        near = np.abs(t - at) <= STILL_S
        low = bool(np.any(near & (height < ground + GROUND_M)))
        sinks = bool(np.any(near & (t <= at) & (v_n[:, 2] > STILL_M_S)))
        climbs = bool(np.any(near & (t >= at) & (v_n[:, 2] < -STILL_M_S)))
        if low and sinks and climbs:
            out.append((at - MARGIN_S, at + MARGIN_S))
    return joined(out)
