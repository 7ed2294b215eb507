"""Servos and a motor that follow their commands with a lag of first order."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.flight import History
from onboard.core.vehicle.recursion import Remembered, behind

NOMINAL_S = 0.14
"""SIM_SERVO_SPEED by default: the time constant of the simulator's servos, s."""


class ServoLag(Effect):
    """Commands pass a low-pass of this time constant; beside the effects.

    Also through steps that the flight is without: a step of the rudder is far from any model for a
    moment, and what follows it is where its force is told from that of the sideslip.
    """

    def __init__(self) -> None:
        """Nominally the simulator's."""
        super().__init__([Unknown("servo_lag", NOMINAL_S, 0.1, 0.0, "s")])
        self._late = Remembered()

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Slow the commands down; a lag that is less than none leads by as much."""
        if air.commands is None:
            return
        flight = air.flight
        past = flight.history or History(air.commands, flight.piece)
        late = self._late(behind, past.commands, values[0], past.piece, flight.step_s)
        air.commands = late if flight.history is None else late[flight.place]
