"""Force that goes with what a vehicle does within one flight, beside its drag."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

PLAUSIBLE = 0.3
"""1/s; as much as small rotors drag by [physics]."""


class OwnMotion(ByStep):
    """``f_i = -k_i (v_i - mean of v_i)``, along the body's axes ahead and aside, each flight's own.

    Drag is a law of the wind and of the vehicle's own motion alike.  Over the wind it is told by
    means of whole flights, over the motion by what changes within seconds, and there other things
    go with the velocity, too: air that the rotors have set in motion and that follows, an attitude
    that is late, a trajectory that is flown again and again.  Means over a flight it leaves alone.
    """

    name = ""

    def __init__(self, sigma: float) -> None:
        """Take by how much flights of one vehicle differ in it, 1/s."""
        super().__init__([Unknown(f"moving_{a}", 0.0, sigma, 0.0, "1/s") for a in ("x", "y")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Add it."""
        part = air.flight.part
        steps = np.bincount(part)
        for k, value in enumerate(values):
            v = air.flight.v_b[:, k]
            air.force_b[:, k] -= value * (v - (np.bincount(part, v) / steps)[part])
