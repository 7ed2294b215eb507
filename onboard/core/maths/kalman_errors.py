"""What errors of its inputs do to a Kalman filter, whose gains are its own."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain

FIRST: Final = 3
"""States that are told after each step."""


def kalman_errors(
    moves: Array,
    pushed: Array,
    noise: Array,
    observed: NDArray[np.int64],
    variance: Array,
    x: Array,
    P: Array,
) -> Array:
    """Errors of a filter's first states over n steps, per unit of each of m errors of its inputs.

    Each step is ``x' = (1 + F) x + u``, then measurements of single states: ``x -= K x``.
    The filter does not know of the errors, so its covariance and gains go on as if there were none.

    Args:
        moves: (n, r, s) rows of F that are not zero, which are the first.
        pushed: (n, r, m) u of the same.
        noise: (n, s) variances that a step adds.
        observed: (q,) which states are measured.
        variance: (n, q) of the measurements.
        x: (s, m) errors before; after, on return.
        P: (s, s) the filter's covariance; likewise.

    Returns:
        (n, :data:`FIRST`, m) after each step.
    """
    n, r, s = moves.shape
    out = np.empty((n, FIRST, x.shape[1]))
    loops = compiled_loops()
    if loops is not None:
        given = plain(moves), plain(pushed), plain(noise), observed, plain(variance)
        loops.kalman_errors(*given, x, P, out)
        return out
    F = np.broadcast_to(np.eye(s), (n, s, s)).copy()
    F[:, :r] += moves
    for i in range(n):
        x[:] = F[i] @ x
        x[:r] += pushed[i]
        P[:] = F[i] @ P @ F[i].T
        P.flat[:: s + 1] += noise[i]
        seen = P[:, observed]
        gain = np.linalg.solve(seen[observed] + np.diag(variance[i]), seen.T).T
        x -= gain @ x[observed]
        P -= gain @ seen.T
        P += P.T.copy()
        P *= 0.5
        out[i] = x[:FIRST]
    return out
