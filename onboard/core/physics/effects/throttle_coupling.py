"""An offset that the throttle makes."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect, Origin, on_axes


class ThrottleCoupling(Effect):
    """Offset proportional to throttle: supply voltage, airframe twist."""

    effect = "throttle_coupling"
    code = 14
    title = "The throttle shifts the offset"
    sentence = "the throttle shifts the offset"
    meaning = "`x`, `y`, `z`, m/s² at full throttle"
    bearing = Bearing.WITHIN
    source = "linear in the throttle"
    cure = "separate the autopilot's power wiring from the motors', stiffen its mount"
    apart = "change the throttle at constant attitude"
    needs = ("throttle",)
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "throttle",
        "%",
        "offset error",
        "m/s^2",
        curves.slow("throttle", 100.0),
        lambda x, _: x / 100.0,
    )

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.take_axes("m/s^2", 3.0)

    def acceleration(self, nodes: Signals) -> Array:
        """``-throttle e_i``."""
        throttle = nodes.slow("throttle")
        level = np.zeros(nodes.t.shape) if throttle is None else throttle
        return on_axes(level[..., None])
