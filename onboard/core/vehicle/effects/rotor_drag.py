"""Drag of the rotors: proportional to the speed through the air."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.effects.vertical_drag import rotor_root

PLAUSIBLE = 0.3
"""1/s; small quadrotors have 0.2 to 0.5 [physics]."""
FLOOR_SHARE = 0.05
"""Of the nominal value: what a person would not see in flight [use]."""


class RotorDrag(Effect):
    """``f_i = -c_m sqrt(rho T / (rho_0 T_hover)) u_i`` on both lateral axes."""

    name = "rotor_drag"
    manoeuvre = "fly fast and slow straight legs both ways, with stops between them"

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally the frame's."""
        nominal = frame.rotor_drag
        super().__init__([Unknown("mcoef", nominal, PLAUSIBLE, FLOOR_SHARE * nominal, "1/s")])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag."""
        air.force_b[:, :2] -= values[0] * rotor_root(air)[:, None] * air.u_b[:, :2]
