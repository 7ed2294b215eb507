"""Drag of the rotors: proportional to the speed through the air."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Unknown
from onboard.core.vehicle.effects.vertical_drag import rotor_root

PLAUSIBLE = 0.3
"""1/s; small quadrotors have 0.2 to 0.5 [physics]."""
SMOOTH = 0.01
"""rad, below which a lean makes no difference: the root's slope would have no end [cost]."""
FLOOR_SHARE = 0.05
"""Of the nominal value: what a person would not see in flight [use]."""

DOUBT = 0.007
"""What the law is good for, as a share: motors share the thrust otherwise between two samples of
their outputs [data sheet]."""


class RotorDrag(Effect):
    """``f_i = -c_m sqrt(rho T / (rho_0 T_hover)) u_i`` on both lateral axes."""

    name = "rotor_drag"
    manoeuvre = "fly fast and slow straight legs both ways, with stops between them"

    def __init__(self, frame: CopterAirframe, *, by_components: bool = False) -> None:
        """Nominally the frame's.

        Args:
            frame: to compare with.
            by_components: as ArduPilot's simulator has it: on each axis the roots of the thrust's
                components along the other two, which for rotors that lean is more on one axis.
        """
        self._by_components = by_components
        nominal = frame.rotor_drag
        floor = FLOOR_SHARE * nominal
        super().__init__(
            [Unknown("mcoef", nominal, PLAUSIBLE, floor, "1/s", share=DOUBT, least=0.0)]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag."""
        drag = values[0] * rotor_root(air)[:, None] * air.u_b[:, :2]
        if self._by_components:
            drag = drag * np.array([1.0 + _root(air.tilt[1]), 1.0 + _root(air.tilt[0])])
        air.force_b[:, :2] -= drag

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """By the root: the thrust that holds it has grown with the mass."""
        return [values[0] * math.exp(-0.5 * log_ratio)]


def _root(share: float) -> float:
    """Root of a component's share of the thrust, smooth about none."""
    square = share * share
    return float(square / (square + SMOOTH * SMOOTH) ** 0.75)
