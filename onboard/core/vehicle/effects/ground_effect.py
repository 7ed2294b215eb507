"""More thrust near the ground (I. C. Cheeseman and W. E. Bennett, ARC R&M 3021, 1955)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import NO_GROUND, Effect, Unknown

REACH = 4.0
"""Radii of a rotor up to which it is felt [physics]."""
LEAST_SHARE = 0.02
"""Share of the flight that must be within reach [cost]."""


class GroundEffect(Effect):
    """Thrust grows by ``gain (R / 4h)^2`` at height h over rotors of radius R."""

    name = "ground_effect"
    manoeuvre = "hover for 20 s at half a metre, and for 20 s at 5 m"

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally none, as in ArduPilot's simulator."""
        super().__init__([Unknown("gain", 0.0, 2.0, 0.3, "1")])
        self._radius = math.sqrt(frame.disc_area / max(frame.num_motors, 1.0) / math.pi)

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Lift the thrust."""
        if air.thrust is not None:
            h = np.maximum(air.flight.height - air.flight.ground, self._radius)
            air.thrust = air.thrust * (1.0 + values[0] * (self._radius / (4.0 * h)) ** 2)

    def missing(self, air: Air) -> str:
        """It takes flight near the ground."""
        if air.commands is None:
            return "no motor outputs in the recording"
        if not air.flight.ground_seen:
            return NO_GROUND
        low = air.flight.height - air.flight.ground < REACH * self._radius
        return "" if float(np.mean(low)) > LEAST_SHARE else "not flown near the ground"
