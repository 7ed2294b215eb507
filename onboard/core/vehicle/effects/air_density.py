"""Air that is thinner or thicker than the standard atmosphere's."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown


class AirDensity(Effect):
    """Density is ``1 + excess`` of the standard atmosphere's; it acts on thrust and drag alike."""

    name = "air_density"
    manoeuvre = "fly the same manoeuvres on a hot and on a cold day, or 1000 m apart"

    def __init__(self) -> None:
        """Nominally standard; 10 % is a day of 30 K more."""
        super().__init__([Unknown("excess", 0.0, 0.1, 0.03, "1")])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Change the density."""
        air.rho = air.rho * max(1.0 + values[0], 0.1)
