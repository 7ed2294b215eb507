"""What the autopilot's EKF was told wrong: its accelerometer, and when and where a fix was."""

from __future__ import annotations

from typing import Final

from onboard.core.model import autopilot_attitude, sensor_errors
from onboard.core.model.around import Around
from onboard.core.model.nuisances import AXIS
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown

LATENESS_S: Final = 0.1
"""s by which a receiver's delay is another one than its EKF takes it for: they are 0.1 to 0.25 s
[data sheet]."""
ANTENNA_M: Final = 0.5
"""m by which an antenna is away from where an EKF takes it to be: most are not told, and it is
somewhere on the vehicle [physics]."""
TOLD: Final = (
    *sensor_errors.LATENESS,
    *sensor_errors.ANTENNA,
    *sensor_errors.SCALE,
    *sensor_errors.BETA,
)
"""Columns of these unknowns."""


class EkfSensors(Family):
    """Errors of the recorded attitude that an EKF makes of wrong forces and late velocities.

    A nuisance.  Velocities that are older than the EKF thinks differ from its own by ``-late a``,
    and it tilts until they do not; forces that are wrong tilt it until it has learned their bias.
    A copter's tilt goes with its acceleration, so that such an attitude, were it held for right, is
    as good as another scale of x and y.  An antenna that it is not told of swings about it, which
    it takes for the vehicle.

    The errors are unknowns of their own: which accelerometer and which receiver the EKF used, with
    what parameters and in which of its lanes, a recording need not tell, and an attitude that fits
    no error of this accelerometer must not be held against it.
    """

    name = "ekf_sensors"

    def __init__(self, scale_sigma: float = 0.03, beta_sigma: float = 0.5) -> None:
        """Take prior sigmas of the EKF's accelerometer, by share and m/s^2."""
        self.unknowns = (
            Unknown("ekf_lateness", "s", 0.0, LATENESS_S),
            *(Unknown(f"ekf_antenna_{a}", "m", 0.0, ANTENNA_M) for a in AXIS),
            *(Unknown(f"ekf_scale_{a}", "1", 0.0, scale_sigma) for a in AXIS),
            *(Unknown(f"ekf_beta_{a}", "m/s^2", 0.0, beta_sigma) for a in AXIS),
        )

    def attitude(self, around: Around) -> Direct:
        """Of these errors."""
        told = around.now.slow(autopilot_attitude.TILTED)
        if told is None:
            return NOTHING
        return Direct(ned=told.reshape(-1, 3, sensor_errors.ERRORS)[..., TOLD])
