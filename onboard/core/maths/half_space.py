"""The least of a quadratic with bounds from below."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array


def least_above(N: Array, b: Array, bound: Array) -> Array:
    """(m,) x with ``x >= bound`` that makes ``x N x / 2 - b x`` least.

    What is below its bound is held there, and let go where the slope leads up from it (an active
    set; J. Nocedal and S. J. Wright, *Numerical Optimization*, 2006, section 16.5).

    Args:
        N: (m, m), positive definite.
        b: (m,).
        bound: (m,); minus infinity where there is none.
    """
    held = np.zeros(len(b), dtype=bool)
    x = np.zeros(len(b))
    x[:] = np.linalg.solve(N, b)
    for _ in range(2 * int(np.count_nonzero(np.isfinite(bound)))):
        low = ~held & (x < bound)
        slope = b - N @ x
        if low.any():
            held |= low
        elif np.any(held & (slope > 0.0)):
            held[np.argmax(np.where(held, slope, -np.inf))] = False
        else:
            break
        free = ~held
        x = np.zeros(len(b))
        x[held] = bound[held]
        x[free] = np.linalg.solve(N[np.ix_(free, free)], (b - N @ x)[free])
    out: Array = np.maximum(x, bound)
    return out
