"""Wind that grows with height: a power law."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import NO_GROUND, ByStep, Unknown

TOP_M = 60.0
"""Height from which ArduPilot's simulator lets the wind be constant, m (SIM_WIND_T_ALT)."""
LOWEST_M = 0.5
"""The law has no meaning among the grass, m [physics]."""
LEAST_RATIO = 1.5
"""Ratio of the heights flown (95th to 5th percentile) from which a law shows [physics]."""


class WindProfile(ByStep):
    """``w(h) = w (h / h_mean)^exponent``, constant from ``top`` on."""

    name = "wind_profile"
    manoeuvre = "climb from 5 m to 60 m in the wind, and stop on the way"

    def __init__(self, top: float = TOP_M) -> None:
        """A uniform wind has exponent zero."""
        super().__init__([Unknown("exponent", 0.0, 0.3, 0.05, "1", doubt=0.01)])
        self.top = top

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Scale the wind by height."""
        air.wind_n *= self.factor(air, values[0])[:, None]

    def factor(self, air: Air, exponent: Array | float) -> Array:
        """(n,) wind over that at the mean height."""
        flight = air.flight
        above = np.clip(flight.height - flight.ground, LOWEST_M, self.top)
        mean = np.clip(flight.mean_heights, LOWEST_M, self.top)
        out: Array = (above / mean) ** np.clip(exponent, -1.0, 2.0)
        return out

    def missing(self, air: Air) -> str:
        """It takes heights that differ, above a ground that was seen."""
        if not air.flight.ground_seen:
            return NO_GROUND
        above = np.maximum(air.flight.height - air.flight.ground, LOWEST_M)
        low, high = np.percentile(above, [5, 95])
        if min(high, self.top) > LEAST_RATIO * min(low, self.top):
            return ""
        return f"flown between {low:.0f} and {high:.0f} m only"
