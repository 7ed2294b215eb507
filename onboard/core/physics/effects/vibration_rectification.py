"""An offset that vibration makes."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect, Origin, on_axes


class VibrationRectification(Effect):
    """Offset that grows with the square of vibration."""

    effect = "vibration_rectification"
    code = 13
    title = "Vibration shifts the offset"
    sentence = "vibration shifts the offset"
    meaning = "`x`, `y`, `z`, s²/m"
    bearing = Bearing.WITHIN
    source = "vibration rectification error, IEEE Std 1293 and MEMS data sheets"
    cure = "damp the autopilot's mount, balance propellers"
    apart = "change the vibration level: hover, cruise, full throttle"
    needs = ("vibration",)
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "vibration",
        "m/s^2",
        "offset error",
        "m/s^2",
        curves.slow("vibration"),
        lambda x, _: x**2,
    )

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.take_axes("s^2/m", 0.1)

    def acceleration(self, nodes: Signals) -> Array:
        """``-vibe_i^2 e_i``."""
        vibe = nodes.slow("vibration")
        return on_axes(np.zeros((*nodes.t.shape, 3)) if vibe is None else vibe**2)
