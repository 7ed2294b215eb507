"""Lift of a plane: linear in the angle of attack."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air, speed_of
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.plane_airframe import PlaneAirframe

FLOOR_SHARE = 0.1
"""Of the nominal coefficients: what moves a plane's attitude by less than half a degree [use]."""


class Lift(Effect):
    """``c_lift_0 + c_lift_a alpha``, across the flow."""

    name = "lift"
    manoeuvre = "fly slow and fast level legs, and turns of 45 degrees"
    together = True

    def __init__(self, frame: PlaneAirframe) -> None:
        """Nominally the file's."""
        super().__init__(
            [
                Unknown(
                    "c_lift_0", frame.c_lift_0, 0.3, FLOOR_SHARE * abs(frame.c_lift_0), "1", 0.01
                ),
                Unknown(
                    "c_lift_a",
                    frame.c_lift_a,
                    2.0,
                    FLOOR_SHARE * abs(frame.c_lift_a),
                    "1/rad",
                    share=0.01,
                ),
            ]
        )
        self._frame = frame

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the lift, and keep its coefficient for the drag that it induces."""
        u = air.u_b
        air.alpha = np.arctan2(u[:, 2], u[:, 0])
        air.pressure = self._frame.pressure(air.rho, air.by_flow(speed_of))
        air.lift, air.slope = values[0] + values[1] * air.alpha, values[1]
        # What the angle scatters by is of the air, whatever slope is tried for the wing.
        air.scatter = self._frame.scatter(air.shaken, air.pressure)
        sin, cos = np.sin(air.alpha), np.cos(air.alpha)
        # Means over angles that scatter: half of the second derivatives times their square.
        steady, more = air.lift * (1.0 - 0.5 * air.scatter), air.slope * air.scatter
        air.force_b[:, 0] += air.pressure * (steady * sin + more * cos)
        air.force_b[:, 2] -= air.pressure * (steady * cos - more * sin)

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Coefficients are by the airframe's mass."""
        return [v * math.exp(-log_ratio) for v in values]
