"""Integrals of a force: between even nodes, over those of intervals, over those about epochs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part


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


@compiled("void(f8[:,:,:,::1], f8[:,::1], f8[:,::1], f8[:,:,:,::1], f8[:,:,:], f8[:,:,:])")
def integrals(P: Array, weight: Array, to_end: Array, x: Array, one: Array, two: Array) -> None:
    """``sum weight P x`` and ``sum to_end P x`` over nodes, into (K, 3, m).

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
        for c in range(m):
            a0 = a1 = a2 = b0 = b1 = b2 = 0.0
            for i in range(M1):
                a, b = weight[k, i], to_end[k, i]
                x0, x1, x2 = x[k, i, 0, c], x[k, i, 1, c], x[k, i, 2, c]
                y0 = P[k, i, 0, 0] * x0 + P[k, i, 0, 1] * x1 + P[k, i, 0, 2] * x2
                y1 = P[k, i, 1, 0] * x0 + P[k, i, 1, 1] * x1 + P[k, i, 1, 2] * x2
                y2 = P[k, i, 2, 0] * x0 + P[k, i, 2, 1] * x1 + P[k, i, 2, 2] * x2
                a0, a1, a2 = a0 + a * y0, a1 + a * y1, a2 + a * y2
                b0, b1, b2 = b0 + b * y0, b1 + b * y1, b2 + b * y2
            one[k, 0, c], one[k, 1, c], one[k, 2, c] = a0, a1, a2
            two[k, 0, c], two[k, 1, c], two[k, 2, c] = b0, b1, b2


OWN = 11
"""Columns of :func:`own`: force, axes, raw force by axis, force that a rate turns, rate by axis."""


@compiled(
    "void(f8[:,:,:,::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1],"
    " f8[:,:,:,::1])"
)
def own(
    P: Array,
    weight: Array,
    to_end: Array,
    w_b: Array,
    raw_s: Array,
    f_b: Array,
    R_bs: Array,
    out: Array,
) -> None:
    """:func:`integrals` of what every model asks of the sensors, without storing it at each node.

    Args:
        P: as of :func:`integrals`.
        weight: see there.
        to_end: see there.
        w_b: (K, M + 1, 3) rad/s.
        raw_s: (K, M + 1, 3) m/s^2.
        f_b: (K, M + 1, 3) m/s^2.
        R_bs: (3, 3) board orientation.
        out: (K, 2, 3, OWN) zero; written to.
    """
    K, M1 = weight.shape
    for k in range(K):
        for i in range(M1):
            f0, f1, f2 = f_b[k, i, 0], f_b[k, i, 1], f_b[k, i, 2]
            w0, w1, w2 = w_b[k, i, 0], w_b[k, i, 1], w_b[k, i, 2]
            t0, t1, t2 = w1 * f2 - w2 * f1, w2 * f0 - w0 * f2, w0 * f1 - w1 * f0
            for r in range(3):
                x, y, z = P[k, i, r, 0], P[k, i, r, 1], P[k, i, r, 2]
                for j, weighs in ((0, weight[k, i]), (1, to_end[k, i])):
                    u, v, w = weighs * x, weighs * y, weighs * z
                    row = out[k, j, r]
                    row[0] += u * f0 + v * f1 + w * f2
                    row[1] += u
                    row[2] += v
                    row[3] += w
                    for c in range(3):
                        across = u * R_bs[0, c] + v * R_bs[1, c] + w * R_bs[2, c]
                        row[4 + c] += across * raw_s[k, i, c]
                    row[7] += u * t0 + v * t1 + w * t2
                    row[8] += u * w0
                    row[9] += v * w1
                    row[10] += w * w2


@compiled(
    "void(f8[:,:,::1], f8[:,:,::1], i8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], i8[::1], "
    "f8[:,:,::1])"
)
def spread(
    R: Array,
    R_epoch: Array,
    first: NDArray[np.int64],
    velocity: Array,
    place: Array,
    x: Array,
    columns: NDArray[np.int64],
    stack: Array,
) -> None:
    """Add ``R_epoch^T sum velocity R x`` and ``R_epoch^T sum place R x``, (K, 3, m) each.

    Args:
        R: (n, 3, 3) body axes of the nodes to those that do not turn.
        R_epoch: (K, 3, 3) those of the epochs to the same.
        first: (K,) number of the first node about each epoch; there may be no such.
        velocity: (K, b) weights of that and the next.
        place: (K, b).
        x: (n, 3, m).
        columns: (m,) of the stack that these are added to.
        stack: (K, 9, ..) rows 0 to 2 for the first, 3 to 5 for the second.
    """
    n, _, m = x.shape
    K, b = velocity.shape
    turned, of_v, of_p = np.empty((n, 3 * m)), np.empty(3 * m), np.empty(3 * m)
    for i in range(n):
        u, v, w = x[i, 0], x[i, 1], x[i, 2]
        for r in range(3):
            d, e, f = R[i, r, 0], R[i, r, 1], R[i, r, 2]
            row = turned[i, r * m : (r + 1) * m]
            for c in range(m):
                row[c] = d * u[c] + e * v[c] + f * w[c]
    for k in range(K):
        of_v[:] = 0.0
        of_p[:] = 0.0
        for j in range(max(0, -first[k]), min(b, n - first[k])):
            y, weighs, places = turned[first[k] + j], velocity[k, j], place[k, j]
            for c in range(3 * m):
                of_v[c] += weighs * y[c]
                of_p[c] += places * y[c]
        for r in range(3):
            d, e, f = R_epoch[k, 0, r], R_epoch[k, 1, r], R_epoch[k, 2, r]
            seen, there = stack[k, r], stack[k, 3 + r]
            for c in range(m):
                seen[columns[c]] += d * of_v[c] + e * of_v[m + c] + f * of_v[2 * m + c]
                there[columns[c]] += d * of_p[c] + e * of_p[m + c] + f * of_p[2 * m + c]


@part
def _beyond(shapes: Array, x: float) -> float:
    """What of the shapes' response is beyond a place x, s, less that of the moment itself."""
    out, ahead = 0.0, max(-x, 0.0)
    for i in range(len(shapes)):
        share, kind, a, b = shapes[i, 0], shapes[i, 1], shapes[i, 2], shapes[i, 3]
        if kind == 0.0:
            within = min(max(0.5 * a - x, 0.0), a)
            y = -x if x < -0.5 * a else within * within / (2.0 * a)
        elif kind == 1.0:
            y = (1.0 - a) * max(a * b - x, 0.0) + a * max((a - 1.0) * b - x, 0.0)
        else:
            before = max(a - x, 0.0)
            y = before - a * (1.0 - np.exp(-before / a))
        out += share * (y - ahead)
    return out


@compiled("void(f8[:,::1], f8, f8[:,::1], f8[:,::1])")
def averaging(since: Array, step: float, shapes: Array, out: Array) -> None:
    """:func:`onboard.core.model.spread.velocity_weights`, into (K, n).

    Args:
        since: (K, n) from the epoch to the node, s, in order, a ``step`` apart.
        step: s.
        shapes: (S, 4) share of each, its kind (0 even, 1 two moments, 2 lag) and what that asks
            for.
        out: written to.
    """
    K, n = since.shape
    for k in range(K):
        beyond = _beyond(shapes, since[k, 0] - 0.5 * step)
        for j in range(n):
            further = _beyond(shapes, since[k, j] + 0.5 * step)
            out[k, j] = beyond - further
            beyond = further
