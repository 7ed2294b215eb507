"""What the calibration of the accelerometer leaves unknown."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown


class SensorOffset(ByStep):
    """A constant on each axis, as far from zero as the sensor level allows; beside the effects."""

    def __init__(self, sigma: Array) -> None:
        """Take the sigma (3,) of the force that the calibration leaves, m/s^2."""
        super().__init__(
            [
                Unknown(f"offset_{a}", 0.0, float(s), 0.0, "m/s^2")
                for a, s in zip("xyz", sigma, strict=True)
            ]
        )

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Add it."""
        for axis, its in enumerate(values):
            air.force_b[:, axis] += its
