"""Motors that answer late."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown

FLOOR_S = 0.03
"""Lags below this are within the steps of outputs logged at 10 Hz, s [data sheet]."""
LONGEST_S = 1.0


class MotorLag(Effect):
    """Thrust follows the command with a lag, whose first moment this is."""

    name = "motor_lag"
    manoeuvre = "give short bursts of throttle, and log the outputs at 50 Hz or faster"

    def __init__(self) -> None:
        """Nominally none (slew_max 150/s is a hundredth of a second)."""
        super().__init__([Unknown("time_constant", 0.0, 0.1, FLOOR_S, "s", doubt=0.003)])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Delay the commands."""
        if air.commands is None:
            return
        t, lag = air.flight.t, float(np.clip(values[0], -LONGEST_S, LONGEST_S))
        c = air.commands
        air.commands = np.stack([np.interp(t - lag, t, c[:, j]) for j in range(c.shape[1])], 1)

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"
