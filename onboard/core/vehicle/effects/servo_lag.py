"""Servos and a motor that follow their commands with a lag of first order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.recursion import SHORTEST_LAG_S, lagged

NOMINAL_S = 0.14
"""SIM_SERVO_SPEED by default: the time constant of the simulator's servos, s."""


class ServoLag(Effect):
    """Commands pass a low-pass of this time constant; beside the effects."""

    def __init__(self) -> None:
        """Nominally the simulator's."""
        super().__init__([Unknown("servo_lag", NOMINAL_S, 0.1, 0.0, "s")])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Slow the commands down."""
        if air.commands is None:
            return
        tau = float(np.clip(values[0], SHORTEST_LAG_S, 1.0))
        air.commands = lagged(air.commands, tau, air.flight.piece, air.flight.step_s)
