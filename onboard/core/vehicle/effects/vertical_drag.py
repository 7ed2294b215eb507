"""Drag along the rotors' axis, and the pull of the rotors that the accelerometer shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY
from onboard.core.vehicle.effects.effect import Effect, Unknown

LEAST_PULL = 0.05
"""Share of gravity below which rotors are taken to idle [physics]."""
TURNS = 4
"""Of the fixed point of pull and its drag, which contracts by a third each [cost]."""


def rotor_root(air: Air) -> Array:
    """(n,) ``sqrt(rho T / (rho_0 T_hover))``: what momentum drag is proportional to.

    It is summed over the motors: those that share the thrust unevenly have less.  By mass it goes
    with the root of it, as the thrust of a heavier vehicle has grown with it.
    """
    load = np.maximum(air.pull / STANDARD_GRAVITY, LEAST_PULL)
    out: Array = air.evenness * np.sqrt(air.rho / SEA_LEVEL_DENSITY * load / air.mass)
    return out


class VerticalDrag(Effect):
    """Linear and quadratic drag along z; estimated beside the effects."""

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally that of the sides."""
        super().__init__(
            [
                Unknown("rotor_z", frame.rotor_drag, 0.3, 0.0, "1/s"),
                Unknown("body_z", frame.body_drag, 0.1, 0.0, "m^2/kg"),
            ]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Free the measured force of it, and predict it."""
        linear, quadratic = values
        u = air.u_b[:, 2]
        still = 0.5 * air.rho * quadratic * air.square_b[:, 2] / air.mass
        measured = -air.flight.f_b[:, 2]
        air.pull = measured
        for _ in range(TURNS):
            air.pull = measured - linear * rotor_root(air) * u - still
        u = u + air.through
        still = -0.5 * air.rho * quadratic * air.square_through / air.mass
        air.force_b[:, 2] -= linear * rotor_root(air) * u + still
