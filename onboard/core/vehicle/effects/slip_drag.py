"""Drag of a plane that slips: its body's side meets the air."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown

PLAUSIBLE = 0.5
"""Of light planes and models, by the square of a radian [physics]."""
STRAIGHT = 0.2
"""Likewise by a radian: a light plane's in simulators that take it so (JSBSim's c172p: 0.17)
[data sheet]."""


def _slip(u_b: Array) -> Array:
    """(n,) size of the angle of sideslip, rad."""
    out: Array = np.abs(np.arctan2(u_b[:, 1], u_b[:, 0]))
    return out


class SlipDrag(Effect):
    """``square beta^2 + straight |beta|``, along the flow; beside the effects, after the lift.

    The simulator's plane has none.  Left to the drag of the profile it would be taken for what the
    throttle does in turns.  A body that the air follows has drag by the square; one with edges,
    from which the air parts on the lee side at once, nearly by the angle itself.
    """

    def __init__(self) -> None:
        """Nominally none, as the simulator's."""
        super().__init__(
            [
                Unknown("slip_drag", 0.0, PLAUSIBLE, 0.0, "1"),
                Unknown("slip_drag_straight", 0.0, STRAIGHT, 0.0, "1"),
            ]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag."""
        slip = air.by_flow(_slip)
        air.force_b[:, 0] -= air.pressure * (values[0] * slip + values[1]) * slip
