"""Whose gyroscope carries the attitude for an accelerometer.

A vehicle has one attitude, its gyroscopes are soldered at angles of their own.  One that is off by
a degree against its accelerometer turns a hundredth of gravity into an offset, and one whose scale
is off by some per cent adds a tilt in every turn; against the recorded attitude, which comes from
the first of them, both look like errors of the *accelerometer*.  What all accelerometers have in
common must not be estimated for each apart: those that are not one chip with their own gyroscope
use that of the first IMU that measures.
"""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import AS_DENSE, SAME_RAD_S
from onboard.core.inputs.stuck import stuck
from onboard.core.inputs.tracks import ImuTrack
from onboard.core.maths.arrays import Array
from onboard.core.maths.interpolation import Hermite


def rates_at(track: ImuTrack, at: Array, longest_gap: float) -> Array | None:
    """Angular rates of one IMU at the sample times of another.

    Args:
        track: whose rates.
        at: (n,) increasing times, s.
        longest_gap: between samples that may be bridged, s.

    Returns:
        (n, 3) rad/s; None if the track does not cover these times as densely as they are, or
        repeats one reading.
    """
    t, rows = track.arrays()
    inside = slice(*np.searchsorted(t, [at[0] - longest_gap, at[-1] + longest_gap]))
    t, w = t[inside], rows[inside, :3]
    if len(t) < 4 or np.median(np.diff(t)) > AS_DENSE * np.median(np.diff(at)):
        return None
    if np.diff(t).max() > longest_gap or t[0] > at[0] + longest_gap or t[-1] < at[-1] - longest_gap:
        return None
    if np.any(stuck(t, w, SAME_RAD_S)):
        return None
    return Hermite(t, w)(np.clip(at, t[0], t[-1]))
