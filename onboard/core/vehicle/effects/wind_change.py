"""A wind that becomes another one, over minutes or at a moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.flight import Flight

CHANGE = "wind_change"
"""What it is called where it is asked for."""
EVERY_S = 60.0
"""s between the moments at which the wind is told: what is faster is a gust, of which a flight has
many [physics: the gap in the spectrum of the wind near the ground, I. van der Hoven, Journal of
Meteorology 14 (1957), is at several minutes; a gust lasts seconds]."""
MOST = 12
"""Such moments [cost]."""
PLAUSIBLE_M_S = 3.0
"""By how much the wind of a quarter of an hour differs from its mean, m/s: standard deviation
[physics]."""


class WindChange(Effect):
    """Straight lines from moment to moment, or two levels, without their mean, the wind's.

    Beside the effects: the wind of a flight is its mean.
    """

    def __init__(self, flight: Flight, *, name: str = "", moment: float | None = None) -> None:
        """Take a single flight; by the name it is asked about.

        Args:
            flight: a single one.
            name: by which it is asked about.
            moment: at which one wind gives way to another, s on the boot clock; None: none does.
        """
        self.name = name
        self._moment = moment
        lasted = float(flight.t[-1] - flight.t[0])
        count = 2 if moment is not None else min(int(lasted / EVERY_S), MOST) + 1
        self._knots: Array = flight.t[0] + np.linspace(0.0, lasted, count)
        self._mean = self._shares(flight).mean(axis=0)
        super().__init__(
            [
                Unknown(f"{way}_at_{k}", 0.0, PLAUSIBLE_M_S, 0.0, "m/s")
                for way in ("north", "east")
                for k in range(count)
            ]
        )

    def _shares(self, flight: Flight) -> Array:
        """(n, count) of each moment's wind at the steps."""
        if self._moment is not None:
            after = flight.t >= self._moment
            return np.column_stack([~after, after]).astype(float)
        unit = np.eye(len(self._knots))
        return np.stack([np.interp(flight.t, self._knots, row) for row in unit], axis=1)

    def wind(self, flight: Flight, values: Sequence[float]) -> Array:
        """(n, 2) towards north and east, m/s, beside the mean."""
        shares = self._shares(flight) - self._mean
        out: Array = shares @ np.reshape(np.asarray(values), (2, -1)).T
        return out

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Move the air."""
        air.wind_n[:, :2] += self.wind(air.flight, values)

    def missing(self, air: Air) -> str:
        """It takes two of its spans, or a moment, and one flight."""
        lasted = float(air.flight.t[-1] - air.flight.t[0])
        enough = self._moment is not None or lasted >= 2.0 * EVERY_S
        return "" if air.flight.parts == 1 and enough else "too short for it"
