"""What the motion of the flight leaves unknown of the attitude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown
from onboard.core.vehicle.flight import DRIFT

DRIFTING = "drifting"
"""Unknown of how many of its sigmas the heading drifts by."""
LEAST_RAD = 1e-5
"""An attitude that nobody doubts is as good as that: an attitude's step in a log [cost]."""


class AttitudeError(ByStep):
    """A rotation about north, east and down, as far from none as is left open.

    It is constant, but that the heading drifts: between turns a bias of the gyroscope turns it.

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
        turned = [
            Unknown(f"turned_{axis}", 0.0, float(s), 0.0, "rad")
            for axis, s in zip(("north", "east", "down"), known, strict=True)
        ]
        super().__init__([*turned, Unknown(DRIFTING, 0.0, 1.0, 0.0, "1")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Turn the air's velocity the other way."""
        air.turned_n = np.stack(values[:3], axis=1)
        air.turned_n[:, 2] += values[3] * air.flight.unsure[:, DRIFT]
