"""AHRS_ORIENTATION: ArduPilot's numbered board rotations that are multiples of 90 degrees."""

from __future__ import annotations

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.smoothing import Array

_DEGREES: dict[int, tuple[int, int, int]] = {
    0: (0, 0, 0),
    2: (0, 0, 90),
    4: (0, 0, 180),
    6: (0, 0, 270),
    8: (180, 0, 0),
    10: (180, 0, 90),
    12: (0, 180, 0),
    14: (180, 0, 270),
    16: (90, 0, 0),
    18: (90, 0, 90),
    20: (270, 0, 0),
    22: (270, 0, 90),
    24: (0, 90, 0),
    25: (0, 270, 0),
}


def board_rotation(number: int) -> Array:
    """``R_bs`` (3, 3): sensor axes to body axes.

    Raises:
        ValueError: not one of the right-angle rotations known here.
    """
    if number not in _DEGREES:
        raise ValueError(f"board rotation {number} is not simulated")
    roll, pitch, yaw = (np.array([np.radians(float(a))]) for a in _DEGREES[number])
    out: Array = np.round(rotation.from_euler(roll, pitch, yaw)[0])
    return out
