"""Rotors that are stronger or weaker, or a vehicle that is lighter or heavier."""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown

FLOOR = 0.05
"""Of the logarithm: 5 % of the thrust [use]."""


class ThrustScale(Effect):
    """Full thrust by mass is ``exp(log_ratio)`` of the frame's."""

    name = "thrust_scale"
    commanded = True
    manoeuvre = "hover and climb, with the motor outputs in the log"

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally the frame's hoverThrOut."""
        super().__init__([Unknown("log_ratio", 0.0, 0.7, FLOOR, "1", doubt=0.005)])
        self._full, self._density = frame.full_thrust, frame.reference_density

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Power to thrust."""
        if air.power is not None:
            scale = self._full * math.exp(min(values[0], 5.0))
            air.thrust = scale * air.rho / self._density * air.power / air.mass

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Less thrust by mass."""
        return [values[0] - log_ratio]

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """The ratio to the frame's thrust by mass."""
        ratio = math.exp(min(values[0], 5.0))
        return [Shown("ratio", 1.0, ratio, ratio * sigmas[0], "1")]
