"""Errors of a small Kalman filter, as a loop that numba compiles."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled


@compiled(
    "void(f8[:,:,::1], f8[:,:,::1], f8[:,::1], i8[::1], f8[:,::1],"
    " f8[:,::1], f8[:,::1], f8[:,:,::1])"
)
def kalman_errors(
    moves: Array,
    pushed: Array,
    noise: Array,
    observed: Array,
    variance: Array,
    x: Array,
    P: Array,
    out: Array,
) -> None:
    """:func:`onboard.core.maths.kalman_errors.kalman_errors`, one measurement after the other."""
    n, r, s = moves.shape
    m, o = x.shape[1], out.shape[1]
    gain, grown = np.empty(s), np.empty((r, max(s, m)))
    for i in range(n):
        for a in range(r):
            for c in range(m):
                total = pushed[i, a, c]
                for k in range(s):
                    total += moves[i, a, k] * x[k, c]
                grown[a, c] = total
        for a in range(r):
            for c in range(m):
                x[a, c] += grown[a, c]
        for a in range(r):
            for c in range(s):
                total = 0.0
                for k in range(s):
                    total += moves[i, a, k] * P[k, c]
                grown[a, c] = total
        for a in range(r):
            for c in range(s):
                P[a, c] += grown[a, c]
        for a in range(s):
            for c in range(r):
                total = 0.0
                for k in range(s):
                    total += P[a, k] * moves[i, c, k]
                grown[c, a] = total
        for a in range(s):
            for c in range(r):
                P[a, c] += grown[c, a]
            P[a, a] += noise[i, a]
        for q in range(len(observed)):
            seen = observed[q]
            spread = P[seen, seen] + variance[i, q]
            for a in range(s):
                gain[a] = P[a, seen] / spread
            for c in range(m):
                innovation = -x[seen, c]
                for a in range(s):
                    x[a, c] += gain[a] * innovation
            for c in range(s):
                row = gain[c] * spread
                for a in range(s):
                    P[a, c] -= gain[a] * row
        for a in range(s):
            for c in range(a):
                P[a, c] = P[c, a]
        for a in range(o):
            for c in range(m):
                out[i, a, c] = x[a, c]
