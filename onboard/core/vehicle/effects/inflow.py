"""Air that comes through the rotors from above: less thrust in a climb."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.gusts import positive_square


class Inflow(Effect):
    """Thrust less ``coefficient v^2`` of the climb through the air; beside the effects.

    It is the last to act on the thrust, which then is part of the force.
    """

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally the frame's."""
        super().__init__([Unknown("inflow", frame.inflow, 0.03, 0.0, "1/m")])
        self._density = frame.reference_density

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Take it off, and pull."""
        if air.thrust is None:
            return
        up = -air.u_b[:, 2] - air.through
        square = positive_square(up, air.gust_variance, air.square_through)
        air.thrust = air.thrust - values[0] * air.rho / self._density * square / air.mass
        air.force_b[:, 2] -= air.thrust
