"""Side force of a plane: by sideslip and rudder."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.plane_airframe import PlaneAirframe

FLOOR_SHARE = 0.1
"""Of the nominal coefficient of sideslip [use]."""
RUDDER_FLOOR = 0.05
"""Of the rudder's coefficient [use]."""
HELD = 1e-3
"""Of the plausible sizes: as good as known [cost: rounding]."""
RUDDER = 1
"""Column of the commands."""


class SideForce(Effect):
    """``c_y_b beta + c_y_deltar rudder``."""

    name = "side_force"
    manoeuvre = "kick the rudder to both sides, or fly uncoordinated turns"
    together = True

    def __init__(self, frame: PlaneAirframe, *, steered: bool = True, held: bool = False) -> None:
        """Nominally the file's.

        Args:
            frame: of the plane.
            steered: whether the rudder is known, which goes with the sideslip: without it what is
                found is no number of the airframe's, and has no name.
            held: at the file's numbers, where a flight slips too little to tell any.
        """
        self.name = SideForce.name if steered else ""
        known = HELD if held else 1.0
        floor = FLOOR_SHARE * abs(frame.c_y_b)
        super().__init__(
            [
                Unknown("c_y_b", frame.c_y_b, 0.5 * known, floor, "1/rad", share=0.02),
                Unknown("c_y_deltar", frame.c_y_deltar, 0.2 * known, RUDDER_FLOOR, "1", 0.02),
            ]
        )
        self._constant = frame.c_y_0

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the force; after the lift."""
        u = air.u_b
        coefficient = self._constant + values[0] * np.arctan2(u[:, 1], u[:, 0])
        if air.commands is not None:
            coefficient = coefficient + values[1] * air.commands[:, RUDDER]
        air.force_b[:, 1] += air.pressure * coefficient

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Coefficients are by the airframe's mass."""
        return [v * math.exp(-log_ratio) for v in values]
