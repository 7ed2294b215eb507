"""Scale of the gyroscope: it turns two attitudes alike, the one integrated here and an EKF's."""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.leaky import leaky_integral
from onboard.core.model.around import Around
from onboard.core.model.ekf_loop import DAMPING, LOOP_RAD_S, Recorded, through_loop
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown

HEADING_S: Final = 5.0
"""s in which an EKF takes back what its gyroscope has turned its heading too far: the usual time of
a heading's error [physics; from 1.5 to 30 s the calibration of simulated vehicles with gyroscopes
3 % off differs by a fifth of a sigma]."""


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
        """What one unit of each unknown turns an EKF by, (k, 15): 12 of tilt, 3 of heading.

        ``d' = R e_j w_j`` and what velocities take back of the tilt, by the EKF's loop, and a
        compass of the heading.
        """
        recorded = Recorded.of(segment) if segment.gyro_followed else None
        if recorded is None:
            return None
        turned = recorded.R * recorded.gained(segment.t, segment.w_b)[:, None, :]
        start = recorded.start(before, 15)
        tilt = recorded.looped(turned[:, :2].reshape(-1, 6), start[:12])
        pole = np.full(3, -1.0 / HEADING_S)
        heading = leaky_integral(recorded.t, turned[:, 2], pole, start[12:])
        return recorded.t, np.hstack([tilt, heading])

    def attitude(self, around: Around) -> Direct:
        """What :meth:`remembers` tells, if the recorded attitude follows this gyroscope."""
        followed = around.now.slow(self.name)
        if followed is None:
            return NOTHING
        tilt = through_loop(followed[:, :12], 2.0 * DAMPING * LOOP_RAD_S)
        turned = np.concatenate([tilt, followed[:, 12:]], axis=1)
        return Direct(ned=turned.reshape(-1, 3, 3))
