"""The running estimate as loops that numba compiles.

:class:`~onboard.core.filter.running_estimate.RunningEstimate`, equal to it to rounding.
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.limits import EAGER_EPOCHS, LAZY_EPOCHS
from onboard.core.filter.readings import Index
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import part


@part
def _solve(known: Array, b: Array, theta: Array) -> None:
    """``known theta = b``, by Gauss's elimination of a positive matrix, whose halves are alike."""
    m = len(theta)
    A = known.copy()
    for k in range(m):
        of, per = A[k], 1.0 / A[k, k]
        for i in range(k + 1, m):
            f, row = of[i] * per, A[i]
            for j in range(i, m):
                row[j] -= f * of[j]
            b[i] -= f * b[k]
    for k in range(m - 1, -1, -1):
        x = b[k]
        for j in range(k + 1, m):
            x -= A[k, j] * theta[j]
        theta[k] = x / A[k, k]


@part
def add_to_estimate(
    W: Array, r: int, theta: Array, known: Array, summed: Array, prior: Array, counted: Index
) -> bool:
    """Take the r whitened innovations of an epoch, and solve for the estimate now and then.

    Args:
        W: (B, r, C) whitened innovations.
        r: how many.
        theta: (m,) estimate; written to.
        known: (m, m) its information; written to where it is solved for.
        summed: (m + 1, m + 1) and prior and counted as there.
        prior: see there.
        counted: see there.

    Returns:
        Whether it was solved for.
    """
    m1 = len(summed)
    for a in range(r):
        row = W[0, a]
        for i in range(m1):
            f, out = row[i], summed[i]
            for j in range(m1):
                out[j] += f * row[j]
    counted[0] += 1
    counted[1] += 1
    if counted[1] < (1 if counted[0] < EAGER_EPOCHS else LAZY_EPOCHS):
        return False
    counted[1] = 0
    b = np.empty(m1 - 1)
    for i in range(m1 - 1):
        b[i] = summed[0, i + 1] + prior[1, i]
        for j in range(m1 - 1):
            known[i, j] = summed[i + 1, j + 1]
        known[i, i] += prior[0, i]
    _solve(known, b, theta)
    return True
