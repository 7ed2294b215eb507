"""Turns in a row, and an attitude between its samples as the gyroscope turns.

numba notices changes of this file alone: whoever changes ``place`` of the curves has to touch it.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part
from onboard.core.maths.loops.curves import place

NO_TURN = 1e-12
"""Sine of half an angle below which a rotation vector is twice the quaternion's [bound: to
rounding]."""


@part
def turned_by(x: float, y: float, z: float, R: Array) -> None:
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
def product(A: Array, B: Array, out: Array) -> None:
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
            turned_by(
                sixth * (a[0] + 4.0 * m[0] + b[0]) + twelfth * (a[1] * b[2] - a[2] * b[1]),
                sixth * (a[1] + 4.0 * m[1] + b[1]) + twelfth * (a[2] * b[0] - a[0] * b[2]),
                sixth * (a[2] + 4.0 * m[2] + b[2]) + twelfth * (a[0] * b[1] - a[1] * b[0]),
                turn,
            )
            product(P[k, i], turn, P[k, i + 1])


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
        i = place(t, at, i)
        u = (at - t[i]) / (t[i + 1] - t[i])
        x = ((powers[i, 3, 0] * u + powers[i, 2, 0]) * u + powers[i, 1, 0]) * u + powers[i, 0, 0]
        y = ((powers[i, 3, 1] * u + powers[i, 2, 1]) * u + powers[i, 1, 1]) * u + powers[i, 0, 1]
        z = ((powers[i, 3, 2] * u + powers[i, 2, 2]) * u + powers[i, 1, 2]) * u + powers[i, 0, 2]
        turned_by(x * h, y * h, z * h, turn)
        if p == 0:
            R[:] = turn
        else:
            before[:] = R
            product(before, turn, R)
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
    factor = 2.0 if sine < NO_TURN else 2.0 * math.atan2(sine, q[0]) / sine
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
        k = place(t_k, at[m], k)
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
        turned_by(share * missed[0], share * missed[1], share * missed[2], A)
        product(turn, A, B)
        product(R_k[k], B, out[m])
