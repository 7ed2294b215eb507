"""ArduPilot's board orientations: how an autopilot is turned in its vehicle.

A sensor's axes are the board's; ``R_bs`` takes their components to the vehicle's body axes (FRD).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array, Vector3
from onboard.core.maths.frames import rotation_from_euler

# AHRS_ORIENTATION: value -> roll, pitch, yaw in degrees, applied in the order of
# rotation_from_euler (ArduPilot AP_Math/rotations.h; its own test checks the same list).
_BOARD_EULER_DEG: Final[dict[int, Vector3]] = {
    0: (0, 0, 0),
    1: (0, 0, 45),
    2: (0, 0, 90),
    3: (0, 0, 135),
    4: (0, 0, 180),
    5: (0, 0, 225),
    6: (0, 0, 270),
    7: (0, 0, 315),
    8: (180, 0, 0),
    9: (180, 0, 45),
    10: (180, 0, 90),
    11: (180, 0, 135),
    12: (0, 180, 0),
    13: (180, 0, 225),
    14: (180, 0, 270),
    15: (180, 0, 315),
    16: (90, 0, 0),
    17: (90, 0, 45),
    18: (90, 0, 90),
    19: (90, 0, 135),
    20: (270, 0, 0),
    21: (270, 0, 45),
    22: (270, 0, 90),
    23: (270, 0, 135),
    24: (0, 90, 0),
    25: (0, 270, 0),
    26: (0, 180, 90),
    27: (0, 180, 270),
    28: (90, 90, 0),
    29: (180, 90, 0),
    30: (270, 90, 0),
    31: (90, 180, 0),
    32: (270, 180, 0),
    33: (90, 270, 0),
    34: (180, 270, 0),
    35: (270, 270, 0),
    36: (90, 180, 90),
    37: (90, 0, 270),
    38: (90, 68.8, 293.3),  # its name says 68 and 293
    39: (0, 315, 0),
    40: (90, 315, 0),
    41: (0, 7, 0),
    42: (45, 0, 0),
    43: (315, 0, 0),
}
# 100 is the custom rotation of firmware up to 4.1, 101 and 102 are CUST_ROT1_* and CUST_ROT2_*.
CUSTOM_ORIENTATIONS: Final = frozenset({100, 101, 102})


def board_rotation(value: float, custom: Vector3 | None = None) -> Array | None:
    """``R_bs`` for a value of AHRS_ORIENTATION.

    Args:
        value: the parameter, an integer that PARAM_VALUE carries as a float.
        custom: roll, pitch, yaw (rad) for the custom values 100 ... 102: CUST_ROT1_ROLL and
            so on (degrees there).

    Returns:
        (3, 3), exact zeros and ones for multiples of 90 deg; None for a value that no known
        firmware defines, and for a custom one without its angles.
    """
    if not np.isfinite(value) or value != int(value):
        return None
    orientation = int(value)
    if orientation in CUSTOM_ORIENTATIONS:
        return None if custom is None else rotation_from_euler(*custom)
    euler = _BOARD_EULER_DEG.get(orientation)
    if euler is None:
        return None
    R = rotation_from_euler(*np.deg2rad(euler))
    nearest = np.round(R)
    # sin(pi) is not zero in floats; + 0.0 turns -0 into 0.
    return nearest + 0.0 if np.allclose(R, nearest, rtol=0, atol=1e-12) else R


def is_axis_aligned(R: ArrayLike) -> bool:
    """True if ``R`` (3, 3) only swaps and flips axes, to 1e-9: a diagonal stays diagonal in it."""
    M = np.abs(np.asarray(R, dtype=np.float64))
    return bool(
        np.all((M < 1e-9) | (np.abs(M - 1) < 1e-9))
        and np.all(M.round().sum(axis=0) == 1)
        and np.all(M.round().sum(axis=1) == 1)
    )
