"""Wind: the air moves over the ground."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

PLAUSIBLE_M_S = 10.0
"""Standard deviation of a component of the wind in which vehicles fly, m/s [physics]."""
FLOOR_M_S = 0.3
"""Wind below this is calm: Beaufort 0 [use]."""

DOUBT_M_S = 0.02
"""What a constant wind is good for, m/s: errors of the velocity do not average out [data sheet]."""


class Wind(ByStep):
    """A constant wind, towards north and east, at the flight's mean height."""

    name = "wind"
    manoeuvre = "fly at two headings, or at two speeds, for a minute each"

    def __init__(self, plausible: float = PLAUSIBLE_M_S) -> None:
        """The nominal air stands still.

        Args:
            plausible: standard deviation of a component; of a wind that was measured, by how much
                it may be off, m/s.
        """
        super().__init__(
            [
                Unknown(name, 0.0, plausible, FLOOR_M_S, "m/s", doubt=DOUBT_M_S)
                for name in ("north", "east")
            ]
        )

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Move the air."""
        air.wind_n[:, 0] += values[0]
        air.wind_n[:, 1] += values[1]
