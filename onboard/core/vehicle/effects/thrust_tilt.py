"""Rotors that do not pull straight up: a lateral force in proportion to their pull."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Unknown

FLOOR_RAD = 0.009
"""Half a degree: how well a motor mount is made [use]."""


class ThrustTilt(Effect):
    """The direction of the pull leans by ``x`` forward and ``y`` to the right."""

    name = "thrust_tilt"
    manoeuvre = "pull up and push over hard, so that the thrust varies by half"

    def __init__(self) -> None:
        """Nominally along the body's axis."""
        super().__init__([Unknown(a, 0.0, 0.1, FLOOR_RAD, "rad", doubt=0.001) for a in ("x", "y")])

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Lean the pull."""
        air.tilt = (values[0], values[1])
        air.force_b[:, :2] += np.asarray(values) * air.pull[:, None]
