"""An offset that grows with time."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics import response_curves as curves
from onboard.core.physics.effect import Bearing, Effect, Origin, on_axes
from onboard.core.physics.finding import Finding


class BiasRamp(Effect):
    """Offset that grows with time."""

    effect = "bias_ramp"
    code = 10
    title = "The offset grows with time"
    sentence = "the offset grew during the flight"
    meaning = "`x`, `y`, `z`, m/s³"
    bearing = Bearing.NO_ONE_NUMBER
    source = "first-order drift, IEEE Std 1293"
    cure = "recalibrate; look for a cause that grows with time (warming, moisture, a loose mount)"
    apart = "fly longer, once cold and once warm"
    of_flight = True
    tilts_ekf = True
    changes_force = True
    response = curves.Response(
        "time", "s", "offset error", "m/s^2", curves.time, lambda x, _about: x
    )

    def __init__(self, origin: Origin) -> None:
        """Take the time from which it counts."""
        super().__init__(origin)
        self.take_axes("m/s^3", 0.01)

    def acceleration(self, nodes: Signals) -> Array:
        """``-(t - t0) e_i``."""
        return on_axes((nodes.t - self.origin.t0)[..., None])

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:
        """The offset at the first sample, and at the end of the flight."""
        said = f"{offset:.4f} at 0 s"
        if found.response_curve is None:
            return f"{said}, {60.0 * change:+.4f} per minute"
        end = float(np.max(found.response_curve.x))
        return f"{said}, {offset + change * end:.4f} at {end:.0f} s"
