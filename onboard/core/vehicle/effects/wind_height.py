"""A wind that is another one at another height, whatever the ground has to do with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.flight import Flight

HEIGHT = "wind_height"
"""What it is called where it is asked for."""
PLAUSIBLE_PER_S = 0.03
"""m/s by m of height: standard deviation of a component (3 m/s in 100 m, as between the layers of a
night) [physics]."""
LEAST_M = 20.0
"""Standard deviation of the height from which it is asked: twice what a receiver's wanders by
[data sheet]."""


class WindByHeight(Effect):
    """A straight line over the height, without its mean, which is the wind's.

    Beside the effects: the simulator's wind is one from 60 m on, and a profile needs the ground.
    """

    def __init__(self, flight: Flight, *, name: str = "") -> None:
        """Take a single flight; by the name it is asked about."""
        self.name = name
        self._mean = float(np.mean(flight.height))
        super().__init__(
            [Unknown(f"{way}_by_m", 0.0, PLAUSIBLE_PER_S, 0.0, "1/s") for way in ("north", "east")]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Move the air."""
        above = air.flight.height - self._mean
        air.wind_n[:, :2] += above[:, None] * np.asarray(values)

    def missing(self, air: Air) -> str:
        """It takes heights, and one flight."""
        enough = air.flight.parts == 1 and float(np.std(air.flight.height)) >= LEAST_M
        return "" if enough else "flown at one height"
