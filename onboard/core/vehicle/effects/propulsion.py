"""Thrust of a plane: along x, in proportion to the throttle."""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown
from onboard.core.vehicle.plane_airframe import THROTTLE, PlaneAirframe

FLOOR = 0.05
"""Of the logarithm: 5 % of the thrust [use]."""


class Propulsion(Effect):
    """Full thrust by mass is ``exp(log_ratio)`` of the simulator's."""

    name = "thrust_scale"
    manoeuvre = "climb at full throttle, then glide"

    def __init__(self, frame: PlaneAirframe) -> None:
        """Nominally the simulator's."""
        super().__init__([Unknown("log_ratio", 0.0, 0.7, FLOOR, "1", doubt=0.01)])
        self._full = frame.full_thrust

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the thrust."""
        if air.commands is not None:
            scale = self._full * math.exp(min(values[0], 5.0))
            air.thrust = scale * air.commands[:, THROTTLE]
            air.force_b[:, 0] += air.thrust

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Less thrust by mass."""
        return [values[0] - log_ratio]

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """The ratio to the simulator's thrust by mass."""
        ratio = math.exp(min(values[0], 5.0))
        return [Shown("ratio", 1.0, ratio, ratio * sigmas[0], "1")]

    def missing(self, air: Air) -> str:
        """It takes the throttle."""
        return "" if air.commands is not None else "no throttle output in the recording"
