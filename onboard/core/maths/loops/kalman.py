"""Errors of a small Kalman filter, as a loop that numba compiles."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part


@part
def moved(rows: Array, x: Array, gained: Array) -> None:
    """``x += F x`` of x (s, m), F having these first rows (r, s); by way of ``gained`` (r, m)."""
    for a in range(rows.shape[0]):
        for c in range(x.shape[1]):
            gained[a, c] = 0.0
        for k in range(x.shape[0]):
            share = rows[a, k]
            if share != 0.0:  # few states move another one
                for c in range(x.shape[1]):
                    gained[a, c] += share * x[k, c]
    for a in range(rows.shape[0]):
        for c in range(x.shape[1]):
            x[a, c] += gained[a, c]


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
    m = x.shape[1]
    gain, off, gained = np.empty(s), np.empty(m), np.empty((r, max(s, m)))
    for i in range(n):
        moved(moves[i], x, gained)
        moved(moves[i], P, gained)
        moved(moves[i], P.T, gained)
        for a in range(r):
            for c in range(m):
                x[a, c] += pushed[i, a, c]
        for a in range(s):
            P[a, a] += noise[i, a]
        for q in range(len(observed)):
            seen = observed[q]
            spread = P[seen, seen] + variance[i, q]
            for a in range(s):
                gain[a] = P[a, seen] / spread
            for c in range(m):
                off[c] = x[seen, c]
            for a in range(s):
                for c in range(m):
                    x[a, c] -= gain[a] * off[c]
                for c in range(s):
                    P[a, c] -= gain[a] * (gain[c] * spread)
        for a in range(s):
            for c in range(a):
                P[a, c] = P[c, a]
        for a in range(out.shape[1]):
            for c in range(m):
                out[i, a, c] = x[a, c]
