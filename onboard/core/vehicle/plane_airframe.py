"""A plane as ArduPilot's simulator describes it: linear coefficients.

Names, defaults and meaning are those of the coefficient files that the simulator loads (facts of
libraries/SITL/SIM_Plane in ArduPilot 4.7-dev).  Its dynamic pressure is that of the *equivalent*
airspeed times the density once more; coefficients are meant in that convention, so that a file that
is handed back flies alike at the same height.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.airframe_file import with_numbers
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY

THROTTLE, ELEVATOR, FLAP = 0, 2, 3
"""Columns of the commands of a plane; the rudder's is between them."""
POSITIVE = ("s", "b", "oswald")
"""Keys of a file that are divided by."""
MASS_KG = 2.0
HOVER_THROTTLE = 0.7
"""Throttle that carries the nominal plane's weight; neither is in the coefficient file."""

LEAST_SLOPE = 1.0
"""m/s^2 by a radian: a wing with less lift carries nothing, and tells no gust [physics]."""


@dataclass(frozen=True, slots=True)
class PlaneAirframe:
    """Keys of a coefficient file that act on the force; m^2, m, rad."""

    s: float = 0.45
    b: float = 1.88
    c: float = 0.24
    c_lift_0: float = 0.56
    c_lift_a: float = 6.9
    oswald: float = 0.9
    alpha_stall: float = 0.4712
    c_drag_p: float = 0.1
    c_y_0: float = 0.0
    c_y_b: float = -0.98
    c_y_deltar: float = -0.2

    @classmethod
    def of(cls, given: Mapping[str, object]) -> PlaneAirframe:
        """The default plane with the numbers of a file in their places.

        Raises:
            ValueError: a key that should be a number is none, or cannot be.
        """
        return with_numbers(cls(), given, POSITIVE, ("induced",))

    @property
    def induced(self) -> float:
        """Induced drag over the square of lift: ``1 / (pi e AR)``."""
        return 1.0 / (math.pi * self.oswald * self.b**2 / self.s)

    @property
    def full_thrust(self) -> float:
        """Specific force at full throttle, m/s^2."""
        return STANDARD_GRAVITY / HOVER_THROTTLE

    def pressure(self, rho: Array, speed: Array) -> Array:
        """(n,) specific force by coefficient, m/s^2: dynamic pressure times area by mass."""
        out: Array = 0.5 * rho * (rho / SEA_LEVEL_DENSITY) * np.square(speed) * self.s / MASS_KG
        return out

    def scatter(self, shaken: Array | float, pressure: Array) -> Array:
        """(n,) mean square of the angle of attack about its mean, rad^2, by that of the lift.

        Args:
            shaken: (n,) mean square of the specific force across the flow, m^2/s^4.
            pressure: (n,) as of :meth:`pressure`.
        """
        slope = np.abs(pressure * self.c_lift_a)
        out: Array = np.where(
            slope > LEAST_SLOPE, shaken / np.maximum(slope, LEAST_SLOPE) ** 2, 0.0
        )
        return out
