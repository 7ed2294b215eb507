"""Scale of the gyroscope: it turns two attitudes alike, the one integrated here and an EKF's."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model import autopilot_attitude, sensor_errors
from onboard.core.model.around import Around
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import OfSensors, Signals
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown


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

    def turned(self, of: OfSensors) -> Array:
        """Of :meth:`rate`."""
        return -of.rate[:, 0]

    def attitude(self, around: Around) -> Direct:
        """What an EKF makes of it, if the recorded attitude follows this gyroscope."""
        now = around.now
        told = now.slow(autopilot_attitude.TILTED) if now.segment.gyro_followed else None
        if told is None:
            return NOTHING
        return Direct(ned=told.reshape(-1, 3, sensor_errors.ERRORS)[..., sensor_errors.GYRO_SCALE])
