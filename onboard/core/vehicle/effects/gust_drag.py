"""What gusts do to the mean force: drag that is quadratic looks linear in gusty air."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown


class GustDrag(ByStep):
    """The gusts' variance along each axis; beside the effects, where the air is turbulent."""

    def __init__(self) -> None:
        """Nominally still."""
        super().__init__([Unknown("gust_variance", 0.0, 4.0, 0.0, "m^2/s^2")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Tell those that act after it."""
        air.gust_variance = values[0]
