"""What gusts that are faster than the steps do to the mean force of a wing: they pull it ahead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

HALF = 0.5
"""Of what shakes the wing within a step, that is of gusts: from nothing, all being vibration of the
motor, to all of it, each share as likely [probability]."""


class GustLift(ByStep):
    """Share of what shakes a wing within the steps that is of gusts; beside the effects.

    Lift stands across the flow.  In air that goes up and down by the angle ``d`` its part ahead is
    ``c_lift_a d`` times ``d``, which is never negative: a wing has less drag in gusts (R.
    Katzmayr, *Zeitschrift fuer Flugtechnik und Motorluftschiffahrt* 13, 1922).  What gusts do
    within a step its mean force does not show, and the drag of the profile would be told less by so
    much: by a fifth in the gusts of ArduPilot's simulator, 2 m/s, half of them within a step, at
    22 m/s.  How large ``d`` was the scatter of the samples says, as far as it is of gusts.
    """

    def __init__(self) -> None:
        """Each share is as likely."""
        spread = 1.0 / math.sqrt(12.0)
        super().__init__([Unknown("gust_lift", HALF, spread, 0.0, "1")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Tell those that act after it."""
        air.shaken = values[0] * air.flight.shaken

    def missing(self, air: Air) -> str:
        """It takes samples that are closer than the steps."""
        return "" if np.any(air.flight.shaken > 0.0) else "no scatter within the steps"
