"""Air that comes to a plane's propeller from ahead: less thrust the faster it flies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.plane_airframe import THROTTLE, PlaneAirframe

PLAUSIBLE = 0.02
"""Of a propeller that pulls no more at 50 m/s, s/m [physics]."""


class PropellerInflow(Effect):
    """Thrust less ``slope V`` of what the propeller's speed makes of it; beside the effects.

    A propeller pulls ``a n^2 - b n V`` (linear in the advance ratio, W. F. Phillips, Mechanics of
    Flight, 2nd ed., 2.3); its speed n goes with the root of the throttle, to which the simulator's
    thrust is proportional, and the simulator's does not know V.
    """

    def __init__(self, frame: PlaneAirframe) -> None:
        """Nominally none, as the simulator's."""
        super().__init__([Unknown("propeller_inflow", 0.0, PLAUSIBLE, 0.0, "s/m")])
        self._full = frame.full_thrust

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Take it off."""
        if air.commands is None:
            return
        turning = np.sqrt(np.clip(air.commands[:, THROTTLE], 0.0, None))
        air.force_b[:, 0] -= self._full * values[0] * turning * air.u_b[:, 0]
