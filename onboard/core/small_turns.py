"""One rotation at a time: what :mod:`onboard.core.frames` does for arrays, at a fifth of the cost.

The filter turns one vector an epoch, where the overhead of array functions would be all there is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def skew_of(a: Array) -> Array:
    """(3, 3) matrix of ``a x`` for one vector (3,)."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turn_by(phi: Array) -> Array:
    """(3, 3) rotation by one rotation vector (3,), rad (Rodrigues)."""
    angle2 = float(phi @ phi)
    K = skew_of(phi)
    if angle2 < 1e-8:
        return np.eye(3) + K + 0.5 * (K @ K)
    angle = np.sqrt(angle2)
    out: Array = (
        np.eye(3) + (np.sin(angle) / angle) * K + ((1.0 - np.cos(angle)) / angle2) * (K @ K)
    )
    return out


def angle_of(R: Array) -> Array:
    """(3,) rotation vector of one rotation (3, 3), |angle| well below pi, rad."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = float(np.sqrt(v @ v))
    if s < 1e-9:
        return v
    c = 0.5 * (float(np.trace(R)) - 1.0)
    out: Array = v * (np.arctan2(s, c) / s)
    return out
