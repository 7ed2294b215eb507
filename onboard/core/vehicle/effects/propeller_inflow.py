"""Air that comes to a plane's propeller from ahead: less thrust the faster it flies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.plane_airframe import THROTTLE, PlaneAirframe

PLAUSIBLE = 0.02
"""Of a propeller that pulls no more at 50 m/s, s/m [physics]."""
BRAKING = 0.5
"""Of the slope: blades that brake meet the air with their backs, and stall [physics]."""


class PropellerInflow(Effect):
    """Thrust less ``slope V`` of what the propeller's speed makes of it; beside the effects.

    A propeller pulls ``a n^2 - b n V`` (linear in the advance ratio, W. F. Phillips, Mechanics of
    Flight, 2nd ed., 2.3); its speed n goes with the root of the throttle, to which the simulator's
    thrust is proportional, and the simulator's does not know V.  Past the speed at which it pulls
    nothing (a glide turns it like a windmill) the line goes on at another slope: less by a share.
    What bends the line elsewhere is drag to whoever measures force
    (:mod:`onboard.core.vehicle.propeller_doubt`).

    Attributes:
        full: specific force of the simulator's at full throttle, m/s^2.
    """

    def __init__(self, frame: PlaneAirframe) -> None:
        """Nominally none, as the simulator's."""
        super().__init__(
            [
                Unknown("propeller_inflow", 0.0, PLAUSIBLE, 0.0, "s/m"),
                Unknown("propeller_braking", 0.0, BRAKING, 0.0, "1"),
            ]
        )
        self.full = frame.full_thrust

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Take it off, after the thrust."""
        if air.commands is None or air.thrust is None:
            return
        slope, braking = values
        turning = np.sqrt(np.clip(air.commands[:, THROTTLE], 0.0, None))
        lost = self.full * slope * turning * air.u_b[:, 0]
        braked = np.minimum(air.thrust - lost, 0.0)
        air.force_b[:, 0] -= lost + braking * braked
