"""A sensor that repeats one reading: it measures nothing."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import STUCK_S
from onboard.core.maths.arrays import Array, Mask


def stuck(t: Array, f: Array) -> Mask:
    """(n,) samples of readings that stay the same on all three axes for :data:`STUCK_S`.

    Args:
        t: (n,) s.
        f: (n, 3) force or rates as reported, or any one-to-one function of them.
    """
    if not len(t):
        return np.zeros(0, dtype=bool)
    begins = np.concatenate([[True], np.any(f[1:] != f[:-1], axis=1)])
    run = np.cumsum(begins) - 1
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(t)) - 1
    out: Mask = (t[last] - t[first] >= STUCK_S)[run]
    return out
