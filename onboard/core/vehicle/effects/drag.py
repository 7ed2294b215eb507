"""Drag of a plane: of its profile, and induced by its lift."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.plane_airframe import PlaneAirframe

FLOOR_SHARE = 0.1
"""Of the nominal coefficients [use]."""


class Drag(Effect):
    """``c_drag_p + induced c_lift^2``, along the flow."""

    name = "drag"
    manoeuvre = "glide and climb at slow and at fast speeds"

    def __init__(self, frame: PlaneAirframe) -> None:
        """Nominally the file's."""
        profile, induced = frame.c_drag_p, frame.induced
        floors = FLOOR_SHARE * profile, 2 * FLOOR_SHARE * induced
        super().__init__(
            [
                Unknown("c_drag_p", profile, 0.1, floors[0], "1", 0.003, least=min(0.0, profile)),
                Unknown("induced", induced, 0.03, floors[1], "1", 0.005, least=0.0),
            ]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag; after the lift."""
        sin, cos = np.sin(air.alpha), np.cos(air.alpha)
        # Means over angles that scatter, as of the lift.
        steady = (values[0] + values[1] * air.lift**2) * (1.0 - 0.5 * air.scatter)
        along = steady + values[1] * air.slope**2 * air.scatter
        across = 2.0 * values[1] * air.lift * air.slope * air.scatter
        air.force_b[:, 0] -= air.pressure * (along * cos - across * sin)
        air.force_b[:, 2] -= air.pressure * (along * sin + across * cos)

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Coefficients are by the airframe's mass; what is induced goes with the lift's square."""
        return [values[0] * math.exp(-log_ratio), values[1] * math.exp(log_ratio)]
