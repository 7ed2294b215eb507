"""Samples to nodes as loops that numba compiles: interpolation, turns in a row, integrals.

Equal to numpy's way to rounding (no fast-math): :class:`~onboard.core.maths.interpolation.Hermite`,
:func:`~onboard.core.maths.frames.rotation_from_vector` and their callers, which are what these are
held to.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part

PIVOT_SHARE = 1e-12
"""Sine of half an angle below which a rotation vector is twice the quaternion's."""


@compiled("void(f8[::1], f8[:,::1], f8[:,:,::1])")
def cubics(t: Array, x: Array, out: Array) -> None:
    """Powers of the share of each interval, into (n - 1, 4, d): three-point slopes."""
    n, d = x.shape
    slope = np.empty((n, d))
    for i in range(1, n - 1):
        a, b = t[i] - t[i - 1], t[i + 1] - t[i]
        before, now, after = -b / (a * (a + b)), (b - a) / (a * b), a / (b * (a + b))
        for c in range(d):
            slope[i, c] = before * x[i - 1, c] + now * x[i, c] + after * x[i + 1, c]
    if n > 2:
        a, b = t[1] - t[0], t[2] - t[1]
        p, q = t[n - 2] - t[n - 3], t[n - 1] - t[n - 2]
        for c in range(d):
            slope[0, c] = (
                -(2.0 * a + b) / (a * (a + b)) * x[0, c]
                + (a + b) / (a * b) * x[1, c]
                - a / (b * (a + b)) * x[2, c]
            )
            slope[n - 1, c] = (
                q / (p * (p + q)) * x[n - 3, c]
                - (q + p) / (p * q) * x[n - 2, c]
                + (2.0 * q + p) / (q * (p + q)) * x[n - 1, c]
            )
    else:
        for c in range(d):
            slope[0, c] = slope[1, c] = (x[1, c] - x[0, c]) / (t[1] - t[0])
    for i in range(n - 1):
        h = t[i + 1] - t[i]
        for c in range(d):
            start, end, rise = h * slope[i, c], h * slope[i + 1, c], x[i + 1, c] - x[i, c]
            out[i, 0, c] = x[i, c]
            out[i, 1, c] = start
            out[i, 2, c] = 3.0 * rise - 2.0 * start - end
            out[i, 3, c] = start + end - 2.0 * rise


@part
def _place(t: Array, at: float, near: int) -> int:
    """The interval (0 to n - 2) that a time is in, from one that is near: times come in order."""
    i, last = near, len(t) - 2
    while i < last and t[i + 1] <= at:
        i += 1
    while i > 0 and t[i] > at:
        i -= 1
    return i


@compiled("void(f8[::1], f8[:,:,::1], f8[::1], f8[:,::1])")
def values(t: Array, powers: Array, at: Array, out: Array) -> None:
    """What :func:`cubics` are at times ``at`` (m,), into (m, d); end cubics go on."""
    d, i = powers.shape[2], 0
    for k in range(len(at)):
        i = _place(t, at[k], i)
        u = (at[k] - t[i]) / (t[i + 1] - t[i])
        for c in range(d):
            out[k, c] = (
                (powers[i, 3, c] * u + powers[i, 2, c]) * u + powers[i, 1, c]
            ) * u + powers[i, 0, c]


@compiled(
    "void(f8[::1], f8[:,:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1],"
    " f8[:,::1])"
)
def signals(
    t: Array,
    powers: Array,
    at: Array,
    bias: Array,
    six: Array,
    R_bs: Array,
    w_b: Array,
    raw_s: Array,
    f_b: Array,
) -> None:
    """What :func:`cubics` of rate and raw force are at times ``at`` (m,), and what that is felt as.

    Args:
        t: (n,) of the samples, s.
        powers: (n - 1, 4, 6).
        at: (m,) s.
        bias: (3,) taken off the rates, rad/s.
        six: (6,) scale and beta.
        R_bs: (3, 3) board orientation.
        w_b: (m, 3) written to.
        raw_s: (m, 3) written to.
        f_b: (m, 3) written to.
    """
    i, x, f = 0, np.empty(6), np.empty(3)
    for k in range(len(at)):
        i = _place(t, at[k], i)
        u = (at[k] - t[i]) / (t[i + 1] - t[i])
        for c in range(6):
            x[c] = ((powers[i, 3, c] * u + powers[i, 2, c]) * u + powers[i, 1, c]) * u + powers[
                i, 0, c
            ]
        for c in range(3):
            w_b[k, c] = x[c] - bias[c]
            raw_s[k, c] = x[3 + c]
            f[c] = x[3 + c] * six[c] + six[3 + c]
        for c in range(3):
            f_b[k, c] = R_bs[c, 0] * f[0] + R_bs[c, 1] * f[1] + R_bs[c, 2] * f[2]


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


@compiled("void(f8, f8, f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8[:,::1], f8[:,::1])")
def gained(
    start: float,
    step: float,
    a: Array,
    v: Array,
    x: Array,
    t: Array,
    shift: float,
    velocity: Array,
    place: Array,
) -> None:
    """Integrals of :func:`twice` at times ``t + shift`` (k,), into two (k, 3)."""
    last = len(a) - 2
    for k in range(len(t)):
        at = t[k] + shift - start
        i = min(max(int(at / step), 0), last)
        s = at - i * step
        for c in range(3):
            slope = (a[i + 1, c] - a[i, c]) / step
            velocity[k, c] = v[i, c] + s * (a[i, c] + 0.5 * s * slope)
            place[k, c] = x[i, c] + s * (v[i, c] + s * (0.5 * a[i, c] + s / 6.0 * slope))


@part
def _turn(x: float, y: float, z: float, R: Array) -> None:
    """Rotation by a vector, rad, into (3, 3), by way of the unit quaternion."""
    angle = math.sqrt(x * x + y * y + z * z)
    factor = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    w = 2.0 * math.cos(0.5 * angle)
    x, y, z = factor * x, factor * y, factor * z
    xx, yy, zz = 2.0 * x * x, 2.0 * y * y, 2.0 * z * z
    xy, xz, yz = 2.0 * x * y, 2.0 * x * z, 2.0 * y * z
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - yy - zz, xy - w * z, xz + w * y
    R[1, 0], R[1, 1], R[1, 2] = xy + w * z, 1.0 - xx - zz, yz - w * x
    R[2, 0], R[2, 1], R[2, 2] = xz - w * y, yz + w * x, 1.0 - xx - yy


@part
def _product(A: Array, B: Array, out: Array) -> None:
    """``A B`` of (3, 3) matrices, into another one."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled("void(f8[:,:,::1], f8[::1], f8[:,:,:,::1])")
def turns_in_a_row(w: Array, h: Array, P: Array) -> None:
    """Attitude at nodes against that of the first, into (K, M + 1, 3, 3).

    Args:
        w: (K, 2 M + 1, 3) rates at the nodes and half-way between them, rad/s.
        h: (K,) from node to node, s.
        P: written to.
    """
    K, M1 = P.shape[:2]
    turn = np.empty((3, 3))
    for k in range(K):
        sixth, twelfth = h[k] / 6.0, h[k] * h[k] / 12.0
        for r in range(3):
            for c in range(3):
                P[k, 0, r, c] = 1.0 if r == c else 0.0
        for i in range(M1 - 1):
            a, m, b = w[k, 2 * i], w[k, 2 * i + 1], w[k, 2 * i + 2]
            _turn(
                sixth * (a[0] + 4.0 * m[0] + b[0]) + twelfth * (a[1] * b[2] - a[2] * b[1]),
                sixth * (a[1] + 4.0 * m[1] + b[1]) + twelfth * (a[2] * b[0] - a[0] * b[2]),
                sixth * (a[2] + 4.0 * m[2] + b[2]) + twelfth * (a[0] * b[1] - a[1] * b[0]),
                turn,
            )
            _product(P[k, i], turn, P[k, i + 1])


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


@part
def _gyro_turn(
    t: Array,
    powers: Array,
    since: float,
    until: float,
    delay: float,
    parts: int,
    near: int,
    R: Array,
) -> int:
    """Rotation by the gyroscope between two times, in parts, into (3, 3); where it looked."""
    h = (until - since) / parts
    turn, before = np.empty((3, 3)), np.empty((3, 3))
    i = near
    for p in range(parts):
        at = since - delay + h * (p + 0.5)
        i = _place(t, at, i)
        u = (at - t[i]) / (t[i + 1] - t[i])
        x = ((powers[i, 3, 0] * u + powers[i, 2, 0]) * u + powers[i, 1, 0]) * u + powers[i, 0, 0]
        y = ((powers[i, 3, 1] * u + powers[i, 2, 1]) * u + powers[i, 1, 1]) * u + powers[i, 0, 1]
        z = ((powers[i, 3, 2] * u + powers[i, 2, 2]) * u + powers[i, 1, 2]) * u + powers[i, 0, 2]
        _turn(x * h, y * h, z * h, turn)
        if p == 0:
            R[:] = turn
        else:
            before[:] = R
            _product(before, turn, R)
    return i


@part
def _vector(R: Array, out: Array) -> None:
    """Rotation vector, rad, of (3, 3), into (3,): through the quaternion with the largest pivot."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    q = np.empty(4)
    best, pivot = trace, 0
    for i in range(3):
        if R[i, i] * 2.0 - trace > best:
            best, pivot = R[i, i] * 2.0 - trace, i + 1
    a, b, c = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    if pivot == 0:
        q[0], q[1], q[2], q[3] = 1.0 + trace, a, b, c
    else:
        x, y, z = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
        if pivot == 1:
            q[0], q[1], q[2], q[3] = a, 1.0 + best, x, y
        elif pivot == 2:
            q[0], q[1], q[2], q[3] = b, x, 1.0 + best, z
        else:
            q[0], q[1], q[2], q[3] = c, y, z, 1.0 + best
    size = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if q[0] < 0.0:
        size = -size
    q /= size
    sine = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    factor = 2.0 if sine < PIVOT_SHARE else 2.0 * math.atan2(sine, q[0]) / sine
    for i in range(3):
        out[i] = factor * q[i + 1]


@compiled("void(f8[::1], f8[:,:,::1], f8[::1], f8[:,:,::1], f8[::1], f8, i8, f8[:,:,::1])")
def attitudes(
    t: Array,
    powers: Array,
    t_k: Array,
    R_k: Array,
    at: Array,
    delay: float,
    parts: int,
    out: Array,
) -> None:
    """Attitude between samples as the gyroscope turns, and what that misses spread evenly.

    Args:
        t: (n,) of the gyroscope's samples, s.
        powers: (n - 1, 4, 3) its :func:`cubics`.
        t_k: (k,) of the attitude's samples, s, at least two.
        R_k: (k, 3, 3) the samples.
        at: (m,) on the clock of the attitude, s, inside its samples.
        delay: by how much that clock is ahead of the gyroscope's, s.
        parts: into which a turn is cut.
        out: (m, 3, 3) written to.
    """
    missed, turn = np.zeros(3), np.empty((3, 3))
    A, B = np.empty((3, 3)), np.empty((3, 3))
    k, known, i = 0, -1, 0
    for m in range(len(at)):
        k = _place(t_k, at[m], k)
        if k != known:
            i = _gyro_turn(t, powers, t_k[k], t_k[k + 1], delay, parts, i, turn)
            for r in range(3):
                for c in range(3):
                    A[r, c] = (
                        R_k[k, 0, r] * R_k[k + 1, 0, c]
                        + R_k[k, 1, r] * R_k[k + 1, 1, c]
                        + R_k[k, 2, r] * R_k[k + 1, 2, c]
                    )
            for r in range(3):
                for c in range(3):
                    B[r, c] = turn[0, r] * A[0, c] + turn[1, r] * A[1, c] + turn[2, r] * A[2, c]
            _vector(B, missed)
            known = k
        i = _gyro_turn(t, powers, t_k[k], at[m], delay, parts, i, turn)
        share = (at[m] - t_k[k]) / (t_k[k + 1] - t_k[k])
        _turn(share * missed[0], share * missed[1], share * missed[2], A)
        _product(turn, A, B)
        _product(R_k[k], B, out[m])


@compiled("void(f8[::1], f8[:,::1], f8[::1], f8[:,::1])")
def straight(t: Array, x: Array, at: Array, out: Array) -> None:
    """Straight lines between samples ``x`` (n, d), n >= 2, at times ``at`` (m,), ends held."""
    i = 0
    for k in range(len(at)):
        i = _place(t, at[k], i)
        share = min(max((at[k] - t[i]) / (t[i + 1] - t[i]), 0.0), 1.0)
        for c in range(x.shape[1]):
            out[k, c] = x[i, c] + share * (x[i + 1, c] - x[i, c])


@compiled("void(f8[::1], f8[::1], f8[::1], f8[:,::1])")
def dragged(load: Array, start: Array, plays: Array, out: Array) -> None:
    """Followers that a load (n,) drags along once it is a play away, into (n, plays)."""
    for j in range(len(plays)):
        place, play = start[j], plays[j]
        for i in range(len(load)):
            place = min(max(place, load[i] - play), load[i] + play)
            out[i, j] = place
