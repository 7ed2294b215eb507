"""Scale of the gyroscope: it turns two attitudes alike, the one integrated here and an EKF's."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.model.around import Around
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown

CORRECTED_S: Final = (2.0, 2.0, 5.0)
"""s in which an EKF takes back what its gyroscope has turned it too far about north, east and down.
Tilt: with velocities good to 0.3 m/s five times a second and a gyroscope to 0.015 rad/s, as
ArduPilot's EKF3 has them, its gain is that of a second-order loop of 1 rad/s.  Heading: the usual
time of its error [physics; from 1.5 to 30 s the calibration of simulated vehicles with gyroscopes
3 % off differs by a fifth of a sigma]."""

PIECE: Final = 200
"""Attitudes that are summed at once [cost]."""
MOST_PIECE: Final = 300.0
"""Time constants of a piece, past which nothing of its beginning is left [bound: the square of
e^300 is a number still]."""
_CORRECTED = np.repeat(CORRECTED_S, 3)


class GyroScale(Family):
    """Scale of the gyroscope, which nobody calibrates: a nuisance, 3 % by older data sheets.

    An EKF integrates the same gyroscope, so that in a quick turn the recorded attitude errs as the
    integrated one does, and only then is corrected.  Were it held for right there, it would vouch
    for a gyroscope that is wrong, and scale, offset and hysteresis of the accelerometer would make
    up for the tilt: by three sigma with a gyroscope of 3 %.
    """

    name = "gyro_scale"

    def __init__(self, sigma: float = 0.03) -> None:
        """Take the prior sigma."""
        self.unknowns = tuple(Unknown(f"gyro_scale_{a}", "1", 0.0, sigma) for a in AXIS)

    def rate(self, nodes: Signals) -> Array:
        """``-e_j w_j``: the unknown is what the gyroscope reads too much."""
        return -np.eye(3) * nodes.w_b[..., None, :]

    def remembers(self, segment: Segment, before: Signal | None) -> Signal | None:
        """How far an EKF is turned by one unit of each unknown: (k, 9), rotation vectors in NED.

        ``d' = R e_j w_j - d / T``, row by row of (3, 3), from one recorded attitude to the next,
        with the mean of both.
        """
        inside = slice(*np.searchsorted(segment.t_attitude, segment.t[[0, -1]]))
        t = segment.t_attitude[inside]
        if not segment.gyro_followed or len(t) < 2:
            return None
        R = segment.R_attitude[inside]
        steps = np.diff(segment.t)[:, None] * (segment.w_b[1:] + segment.w_b[:-1])
        angle = np.vstack([np.zeros(3), np.cumsum(0.5 * steps, axis=0)])
        turns = np.diff([np.interp(t, segment.t, a) for a in angle.T]).T
        x = (0.5 * (R[1:] + R[:-1]) * turns[:, None, :]).reshape(-1, 9)
        d = np.zeros((len(t), 9))
        if before is not None:
            d[0] = [np.interp(t[0], before[0], column) for column in before[1].T]
        # What is taken back is put back before it is summed, a piece at a time: after minutes
        # without a fix it would be too large a number.
        for i, j in pairwise([*range(0, len(t) - 1, PIECE), len(t) - 1]):
            left = np.exp(np.maximum((t[i] - t[i : j + 1, None]) / _CORRECTED, -MOST_PIECE))
            middle = np.sqrt(left[1:] * left[:-1])
            d[i + 1 : j + 1] = left[1:] * (d[i] + np.cumsum(x[i:j] / middle, axis=0))
        return t, d

    def attitude(self, around: Around) -> Direct:
        """What :meth:`remembers` tells, if the recorded attitude follows this gyroscope."""
        followed = around.now.slow(self.name)
        return NOTHING if followed is None else Direct(ned=followed.reshape(-1, 3, 3))
