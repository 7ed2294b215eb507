"""Wind: the air moves over the ground."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown

PLAUSIBLE_M_S = 10.0
"""Standard deviation of a component of the wind in which vehicles fly, m/s [physics]."""
FLOOR_M_S = 0.3
"""Wind below this is calm: Beaufort 0 [use]."""

DOUBT_M_S = 0.02
"""What a constant wind is good for, m/s: errors of the velocity do not average out [data sheet]."""


class Wind(Effect):
    """A constant wind, towards north and east, at the flight's mean height."""

    name = "wind"
    manoeuvre = "fly at two headings, or at two speeds, for a minute each"

    def __init__(self) -> None:
        """The nominal air stands still."""
        unit = "m/s"
        super().__init__(
            [
                Unknown("north", 0.0, PLAUSIBLE_M_S, FLOOR_M_S, unit, doubt=DOUBT_M_S),
                Unknown("east", 0.0, PLAUSIBLE_M_S, FLOOR_M_S, unit, doubt=DOUBT_M_S),
            ]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Move the air."""
        air.wind_n[:, 0] += values[0]
        air.wind_n[:, 1] += values[1]
