"""What the motion of the flight leaves unknown of the attitude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

LEAST_RAD = 1e-5
"""An attitude that nobody doubts is as good as that: an attitude's step in a log [cost]."""


class AttitudeError(ByStep):
    """A constant rotation about north, east and down, as far from none as is left open.

    On a straight flight of a plane a heading that is off by a degree is the wind across of a
    sixtieth of the speed, and a pitch that is off is lift: what tells them apart is turning alone.
    A copter's rotors drag by a hundredth of what wings lift.
    """

    def __init__(self, sigma: Array, force_sigma: Array) -> None:
        """Take how well it is known.

        Args:
            sigma: (3,) by the smoother, about north, east and down, rad.
            force_sigma: (3,) what the calibration leaves unknown of the force, m/s^2: along the
                way or across it is a tilt.
        """
        level = float(np.max(force_sigma[:2])) / STANDARD_GRAVITY
        known = np.maximum(np.hypot(sigma, [level, level, 0.0]), LEAST_RAD)
        super().__init__(
            [
                Unknown(f"turned_{axis}", 0.0, float(s), 0.0, "rad")
                for axis, s in zip(("north", "east", "down"), known, strict=True)
            ]
        )

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Turn the air's velocity the other way."""
        air.turned_n = np.stack(values, axis=1)
