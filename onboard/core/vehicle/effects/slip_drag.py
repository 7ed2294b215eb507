"""Drag of a plane that slips: its body's side meets the air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown

PLAUSIBLE = 0.5
"""Of light planes and models, by the square of a radian [physics]."""


class SlipDrag(Effect):
    """``coefficient beta^2``, along the flow; beside the effects, after the lift.

    The simulator's plane has none.  Left to the drag of the profile it would be taken for what the
    throttle does in turns.
    """

    def __init__(self) -> None:
        """Nominally none, as the simulator's."""
        super().__init__([Unknown("slip_drag", 0.0, PLAUSIBLE, 0.0, "1")])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag."""
        slip = np.arctan2(air.u_b[:, 1], air.u_b[:, 0])
        air.force_b[:, 0] -= air.pressure * values[0] * slip**2
