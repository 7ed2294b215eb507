"""An airspeed sensor that reads too much or too little."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air, speed_of
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown

FLOOR = 0.02
"""Of the scale: a pitot tube's own error [data sheet]."""
PITOT_RAD = math.radians(20.0)
"""Between flow and nose: up to so far aside a pitot tube reads all of the speed [data sheet]."""
COLUMN = 3
"""Of the prediction: after the three of the force."""


def simulated_scale(rho: Array) -> float:
    """What ArduPilot's simulator reads over the equivalent airspeed: it corrects density twice."""
    return float(np.mean(np.sqrt(rho / SEA_LEVEL_DENSITY)))


def seen_by_a_pitot(u_b: Array) -> Array:
    """(n,) what a tube along the nose sees of the speed through the air, m/s.

    All of it up to :data:`PITOT_RAD`, then as much as a cosine that ends across the flow: what
    ArduPilot's simulator has, and nearly what tubes do.

    Args:
        u_b: (n, 3) velocity through the air in body axes, m/s.
    """
    angle = np.arctan2(speed_of(u_b[:, 1:]), u_b[:, 0])
    beyond = np.clip((angle - PITOT_RAD) / (0.5 * np.pi - PITOT_RAD), 0.0, 1.0)
    out: Array = speed_of(u_b) * np.cos(0.5 * np.pi * beyond)
    return out


class AirspeedScale(Effect):
    """The reading over the equivalent airspeed.

    A right sensor reads one, the simulator's a little less (:func:`simulated_scale`): whatever is
    between the two is nominal.
    """

    name = "airspeed_scale"
    manoeuvre = "fly turns in the wind, with the airspeed sensor in the log"

    def __init__(self, rho: Array) -> None:
        """Nominally between the simulator's and a right one."""
        self.simulated = simulated_scale(rho)
        middle, half = 0.5 * (1.0 + self.simulated), 0.5 * abs(1.0 - self.simulated)
        scale = Unknown("scale", middle, 0.15, FLOOR + half, "1", doubt=0.003, within=half)
        super().__init__([scale])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Predict the reading."""
        seen = air.by_flow(seen_by_a_pitot)
        air.force_b[:, COLUMN] += values[0] * seen * np.sqrt(air.rho / SEA_LEVEL_DENSITY)

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """Against the simulator's."""
        return [Shown("over_equivalent", self.simulated, values[0], sigmas[0], "1")]
