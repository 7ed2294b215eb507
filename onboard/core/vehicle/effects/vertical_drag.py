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
    return _root_at(air, air.rho / SEA_LEVEL_DENSITY)


def _root_at(air: Air, dense: Array) -> Array:
    """(n,) :func:`rotor_root`, where the density over that at sea level (n,) is there already."""
    load: Array = air.pull / STANDARD_GRAVITY
    np.maximum(load, LEAST_PULL, out=load)
    load *= dense
    if not (isinstance(air.mass, float) and air.mass == 1.0):
        load = load / air.mass
    np.sqrt(load, out=load)
    if air.commands is not None:
        load *= air.evenness
    return load


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
        air.pull, dense = measured, air.rho / SEA_LEVEL_DENSITY
        for _ in range(TURNS):
            drag = _root_at(air, dense)
            drag *= linear
            drag *= u
            air.pull = measured - drag
            air.pull -= still
        u = u + air.through
        still = -0.5 * air.rho * quadratic * air.square_through / air.mass
        air.force_b[:, 2] -= linear * _root_at(air, dense) * u + still
