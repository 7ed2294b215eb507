"""Motors that answer late, or outputs that are logged late."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.flight import History
from onboard.core.vehicle.recursion import Remembered, ahead, behind

DELAY = "output_delay"
"""What a lag that is less than none is called: it is of the log, not of the motors."""
FLOOR_S = 0.03
"""Lags below this are within the steps of outputs logged at 10 Hz, s [data sheet]."""


class MotorLag(Effect):
    """Thrust follows the command behind a low-pass of first order.

    That is what inertia makes of a motor.  A mere delay turns the phase of a tenth of a second by
    more than the low-pass does, and would be found an eighth too short.  No motor answers before it
    is asked: a time constant of less than none is a delay of the outputs in the log, beside which
    nothing is known of the motors.
    """

    name = "motor_lag"
    manoeuvre = "give short bursts of throttle, and log the outputs at 50 Hz or faster"

    def __init__(self) -> None:
        """Nominally none (slew_max 150/s is a hundredth of a second)."""
        super().__init__([Unknown("time_constant", 0.0, 0.1, FLOOR_S, "s", doubt=0.003)])
        self._late = Remembered()

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Slow the commands down; outputs that are late are those of as much later."""
        if air.commands is None:
            return
        law = behind if values[0] >= 0.0 else ahead
        flight = air.flight
        past = flight.history or History(air.commands, flight.piece)
        late = self._late(law, past.commands, abs(values[0]), past.piece, flight.step_s)
        air.commands = late if flight.history is None else late[flight.place]

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"
