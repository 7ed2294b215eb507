"""Motors that answer late."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.recursion import behind

FLOOR_S = 0.03
"""Lags below this are within the steps of outputs logged at 10 Hz, s [data sheet]."""


class MotorLag(Effect):
    """Thrust follows the command behind a low-pass of first order.

    That is what inertia makes of a motor.  A mere delay turns the phase of a tenth of a second by
    more than the low-pass does, and would be found an eighth too short.
    """

    name = "motor_lag"
    manoeuvre = "give short bursts of throttle, and log the outputs at 50 Hz or faster"

    def __init__(self) -> None:
        """Nominally none (slew_max 150/s is a hundredth of a second)."""
        super().__init__([Unknown("time_constant", 0.0, 0.1, FLOOR_S, "s", doubt=0.003)])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Slow the commands down; a lag that is less than none leads by as much."""
        if air.commands is None:
            return
        flight = air.flight
        air.commands = behind(air.commands, values[0], flight.piece, flight.step_s)

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"
