"""Density of the air by height: the standard atmosphere up to 11 km.

Source: U.S. Standard Atmosphere (1976), equations 23, 33a and 42 of the lowest layer; ArduPilot's
simulator flies in the same.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array

SEA_LEVEL_DENSITY: Final = 1.225
"""kg/m^3."""
TEMPERATURE_K: Final = 288.15
LAPSE_K_M: Final = 0.0065
DENSITY_EXPONENT: Final = 4.2559
"""g / (R lapse) - 1 of the lowest layer."""
TOP_M: Final = 11000.0


def density(height: ArrayLike) -> Array:
    """(...) kg/m^3 at heights (...) above mean sea level, m."""
    h = np.clip(np.asarray(height, dtype=np.float64), -1000.0, TOP_M)
    out: Array = SEA_LEVEL_DENSITY * (1.0 - LAPSE_K_M * h / TEMPERATURE_K) ** DENSITY_EXPONENT
    return out
