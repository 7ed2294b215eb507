"""Integrals of a force: between even nodes, over those of intervals, over those about epochs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled


@compiled("void(f8, f8[:,::1], f8[:,::1], f8[:,::1])")
def twice(step: float, a: Array, v: Array, x: Array) -> None:
    """Integrals of an acceleration (n, 3) between even nodes: into (n, 3), and theirs into another.

    First rows are zero, and stay so.
    """
    for i in range(len(a) - 1):
        for c in range(3):
            v[i + 1, c] = v[i, c] + 0.5 * step * (a[i, c] + a[i + 1, c])
            x[i + 1, c] = (
                x[i, c] + step * v[i, c] + step * step / 6.0 * (2.0 * a[i, c] + a[i + 1, c])
            )


@compiled("void(f8, f8, f8[:,::1], f8[:,::1])")
def late(kept: float, share: float, a: Array, z: Array) -> None:
    """A force (n, 3) behind a first-order lag, from what is in the first row of ``z`` (n, 3) on."""
    for i in range(len(a) - 1):
        for c in range(3):
            z[i + 1, c] = kept * z[i, c] + (share - kept) * a[i, c] + (1.0 - share) * a[i + 1, c]


@compiled(
    "void(f8, f8, f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8, f8[::1], f8[:,::1], i8[::1], "
    "f8[:,:,::1])"
)
def seen(
    start: float,
    step: float,
    a: Array,
    v: Array,
    x: Array,
    z: Array,
    lag: float,
    t: Array,
    terms: Array,
    ends: NDArray[np.int64],
    out: Array,
) -> None:
    """Sums of velocity and place of :func:`twice` and of the force of :func:`late` about times.

    Args:
        start: time of the first node, s.
        step: s.
        a: (n, 3) force.
        v: (n, 3).
        x: (n, 3).
        z: (n, 3) force behind a lag.
        lag: s; 0: no term asks for it.
        t: (k,) s.
        terms: (T, 4) shift of the time, weights of velocity, place and lagged force.
        ends: (S,) number behind the last term of each sum.
        out: (S, k, 3) zero; written to.
    """
    last, j, per_s = len(a) - 2, 0, 1.0 / step
    for one in range(len(ends)):
        while j < ends[one]:
            shift, of_v, of_x, of_z = terms[j, 0], terms[j, 1], terms[j, 2], terms[j, 3]
            for k in range(len(t)):
                at = t[k] + shift - start
                i = min(max(int(at / step), 0), last)
                s = at - i * step
                half, sixth = 0.5 * s, s * per_s / 6.0
                # Of v + s (a + s / 2 slope), x + s (v + s (a / 2 + s / 6 slope)), and the lag's.
                for c in range(3):
                    now, rise = a[i, c], a[i + 1, c] - a[i, c]
                    y = of_v * (v[i, c] + s * (now + half * per_s * rise))
                    if of_x != 0.0:
                        y += of_x * (x[i, c] + s * (v[i, c] + s * (0.5 * now + sixth * rise)))
                    out[one, k, c] += y
                if of_z != 0.0:
                    kept = np.exp(-s / lag)
                    for c in range(3):
                        slope = per_s * (a[i + 1, c] - a[i, c])
                        behind = kept * z[i, c] + (1.0 - kept) * (a[i, c] - lag * slope)
                        out[one, k, c] += of_z * (behind + slope * s)
            j += 1


@compiled("void(f8[:,:,:,::1], f8[:,::1], f8[:,::1], f8[:,:,:,::1], f8[:,:,::1], f8[:,:,::1])")
def integrals(P: Array, weight: Array, to_end: Array, x: Array, one: Array, two: Array) -> None:
    """``sum weight P x`` and ``sum to_end P x`` over nodes, into (K, 3, m) that are zero.

    Args:
        P: (K, M + 1, 3, 3) body axes of the node to those of the interval's start.
        weight: (K, M + 1).
        to_end: (K, M + 1).
        x: (K, M + 1, 3, m).
        one: written to.
        two: written to.
    """
    K, M1, _, m = x.shape
    for k in range(K):
        for i in range(M1):
            a, b = weight[k, i], to_end[k, i]
            for r in range(3):
                u, v, w = P[k, i, r, 0], P[k, i, r, 1], P[k, i, r, 2]
                for c in range(m):
                    turned = u * x[k, i, 0, c] + v * x[k, i, 1, c] + w * x[k, i, 2, c]
                    one[k, r, c] += a * turned
                    two[k, r, c] += b * turned


@compiled(
    "void(f8[:,:,::1], f8[:,:,::1], i8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], "
    "f8[:,:,::1], f8[:,:,::1])"
)
def spread(
    R: Array,
    R_epoch: Array,
    first: NDArray[np.int64],
    velocity: Array,
    place: Array,
    x: Array,
    turned: Array,
    one: Array,
    two: Array,
) -> None:
    """``R_epoch^T sum velocity R x`` and ``R_epoch^T sum place R x``, into (K, 3, m) that are zero.

    Args:
        R: (n, 3, 3) body axes of the nodes to those that do not turn.
        R_epoch: (K, 3, 3) those of the epochs to the same.
        first: (K,) number of the first node about each epoch; there may be no such.
        velocity: (K, b) weights of that and the next.
        place: (K, b).
        x: (n, 3, m).
        turned: (n, 3, m), for what is in between.
        one: written to.
        two: written to.
    """
    n, _, m = x.shape
    K, b = velocity.shape
    for i in range(n):
        for r in range(3):
            for c in range(m):
                turned[i, r, c] = (
                    R[i, r, 0] * x[i, 0, c] + R[i, r, 1] * x[i, 1, c] + R[i, r, 2] * x[i, 2, c]
                )
    for k in range(K):
        for j in range(max(0, -first[k]), min(b, n - first[k])):
            v, p, i = velocity[k, j], place[k, j], first[k] + j
            for r in range(3):
                for c in range(m):
                    one[k, r, c] += v * turned[i, r, c]
                    two[k, r, c] += p * turned[i, r, c]
        for both in (one, two):
            for c in range(m):
                x0, x1, x2 = both[k, 0, c], both[k, 1, c], both[k, 2, c]
                for r in range(3):
                    both[k, r, c] = (
                        R_epoch[k, 0, r] * x0 + R_epoch[k, 1, r] * x1 + R_epoch[k, 2, r] * x2
                    )
