"""Which kind of vehicle flies like this: a copter stops in the air, a plane does not."""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array

SLOW_M_S: Final = 3.0
FAST_M_S: Final = 7.0
"""Speed over ground that a tenth of the flight is slower than, m/s, of a copter and of a plane: the
one stops now and then, the other cannot [physics]."""
ALOFT_M: Final = 10.0
"""m above the lowest place from which a vehicle flies: a receiver's height wanders by some of
them, and a runway slopes [data sheet]."""
ALOFT_S: Final = 10.0
"""s of flight there that are asked by themselves: a plane climbs out for longer [physics]."""


def kind_by_motion(t: Array, v_n: Array, height: Array) -> str:
    """``copter`` or ``plane``; empty where it is not clear which.

    On the ground both stand: what is well above the lowest place is asked, if anything was.

    Args:
        t: (n,) times of fixes, s.
        v_n: (n, 2 or 3) their velocities, m/s.
        height: (n,) m.
    """
    if len(t) < 2:
        return ""
    step_s = float(np.median(np.diff(t)))
    speed = np.linalg.norm(np.nan_to_num(v_n[:, :2]), axis=1)
    # Of a wild fix or two, no ground is made.
    known = np.isfinite(height)
    ground = float(np.percentile(height[known], 1)) if known.any() else np.inf
    aloft = known & (height > ground + ALOFT_M)
    if np.count_nonzero(aloft) * step_s >= ALOFT_S:
        speed = speed[aloft]
    slow = float(np.percentile(speed, 10))
    if slow < SLOW_M_S:
        return "copter"
    return "plane" if slow > FAST_M_S else ""
