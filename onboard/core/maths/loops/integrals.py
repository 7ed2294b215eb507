"""Integrals of a force: once and twice between even nodes, and over the nodes of intervals."""

from __future__ import annotations

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


@compiled("void(f8, f8, f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[:,::1], f8[:,::1])")
def gained(
    start: float,
    step: float,
    a: Array,
    v: Array,
    x: Array,
    t: Array,
    velocity: Array,
    place: Array,
) -> None:
    """Integrals of :func:`twice` at times ``t`` (k,), into two (k, 3)."""
    last = len(a) - 2
    for k in range(len(t)):
        at = t[k] - start
        i = min(max(int(at / step), 0), last)
        s = at - i * step
        for c in range(3):
            slope = (a[i + 1, c] - a[i, c]) / step
            velocity[k, c] = v[i, c] + s * (a[i, c] + 0.5 * s * slope)
            place[k, c] = x[i, c] + s * (v[i, c] + s * (0.5 * a[i, c] + s / 6.0 * slope))


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
