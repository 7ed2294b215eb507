"""How thrust grows with the command: from proportional to quadratic."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Unknown

FLOOR = 0.05
"""Of the exponent: MOT_THST_EXPO is set in steps like this [use]."""


class ThrustCurve(Effect):
    """``(1 - expo) c + expo c^2`` of full thrust at command c, mean over the motors."""

    name = "thrust_curve"
    commanded = True
    manoeuvre = "climb and descend at full and at low throttle, for ten seconds each"

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally the frame's propExpo."""
        super().__init__([Unknown("expo", frame.propExpo, 0.5, FLOOR, "1", doubt=0.006)])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Commands to power."""
        if air.commands is not None:
            mean, square = air.commands[:, 0], air.commands[:, 1]
            air.power = (1.0 - values[0]) * mean + values[0] * square

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"
