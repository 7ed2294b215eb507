"""A sensor that repeats one reading: it measures nothing."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import STUCK_S
from onboard.core.maths.arrays import Array, Mask


def stuck(t: Array, x: Array, same: float) -> Mask:
    """(n,) samples of readings that stay the same on all three axes for :data:`STUCK_S`.

    Args:
        t: (n,) s.
        x: (n, 3) force or rates as reported, or any linear function of them.
        same: by so much readings that are the same may differ, in the unit of ``x``
            (:data:`~onboard.core.inputs.limits.SAME_M_S2`,
            :data:`~onboard.core.inputs.limits.SAME_RAD_S`).
    """
    if not len(t):
        return np.zeros(0, dtype=bool)
    begins = np.concatenate([[True], np.any(np.abs(np.diff(x, axis=0)) > same, axis=1)])
    run = np.cumsum(begins) - 1
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(t)) - 1
    # What creeps by less than that from sample to sample moves, too.
    spread = np.maximum.reduceat(x, first) - np.minimum.reduceat(x, first)
    stays = np.all(spread <= 2.0 * same, axis=1)
    out: Mask = ((t[last] - t[first] >= STUCK_S) & stays)[run]
    return out
