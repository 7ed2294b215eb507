"""Turns by the gyroscope, and an attitude between its samples as they go."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from onboard.core.maths.arrays import Array, Vector3
from onboard.core.maths.compiler import compiled, part
from onboard.core.maths.loops.curves import place

NO_TURN = 1e-12
"""Sine of half an angle below which a rotation vector is twice the quaternion's [bound: to
rounding]."""

SMALL_HALF = 1e-3
"""Square of half an angle, rad^2, below which four terms of sine and cosine are all of them [bound:
to rounding; the fifth is 3e-17 of one]."""


Nine: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
"""A (3, 3) matrix, row by row, as loops that follow one turn after the other keep it."""


@part
def turn_by(x: float, y: float, z: float) -> Nine:
    """Rotation by a vector, rad, by way of the unit quaternion."""
    square = 0.25 * (x * x + y * y + z * z)
    if square < SMALL_HALF:
        # Between nodes nearly all are so small, and sine and cosine are most of what a turn costs.
        factor = 0.5 - square / 12.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
        w = 2.0 - square * (1.0 - square / 12.0 * (1.0 - square / 30.0))
    else:
        half = math.sqrt(square)
        factor, w = 0.5 * math.sin(half) / half, 2.0 * math.cos(half)
    x, y, z = factor * x, factor * y, factor * z
    xx, yy, zz = 2.0 * x * x, 2.0 * y * y, 2.0 * z * z
    xy, xz, yz = 2.0 * x * y, 2.0 * x * z, 2.0 * y * z
    return (
        *(1.0 - yy - zz, xy - w * z, xz + w * y),
        *(xy + w * z, 1.0 - xx - zz, yz - w * x),
        *(xz - w * y, yz + w * x, 1.0 - xx - yy),
    )


@part
def turned(A: Array, turn: Nine, out: Array) -> None:
    """A (3, 3) matrix times another one, into a third, which may be the first."""
    for r in range(3):
        a, b, c = A[r, 0], A[r, 1], A[r, 2]
        out[r, 0] = a * turn[0] + b * turn[3] + c * turn[6]
        out[r, 1] = a * turn[1] + b * turn[4] + c * turn[7]
        out[r, 2] = a * turn[2] + b * turn[5] + c * turn[8]


@part
def turn_between(a: Vector3, m: Vector3, b: Vector3, h: float) -> Nine:
    """Rotation by rates at both ends and half-way of a time ``h``, s."""
    sixth, twelfth = h / 6.0, h * h / 12.0
    return turn_by(
        sixth * (a[0] + 4.0 * m[0] + b[0]) + twelfth * (a[1] * b[2] - a[2] * b[1]),
        sixth * (a[1] + 4.0 * m[1] + b[1]) + twelfth * (a[2] * b[0] - a[0] * b[2]),
        sixth * (a[2] + 4.0 * m[2] + b[2]) + twelfth * (a[0] * b[1] - a[1] * b[0]),
    )


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
    R[:] = np.eye(3)
    i = near
    for p in range(parts):
        at = since - delay + h * (p + 0.5)
        i = place(t, at, i)
        u = (at - t[i]) / (t[i + 1] - t[i])
        x = ((powers[i, 3, 0] * u + powers[i, 2, 0]) * u + powers[i, 1, 0]) * u + powers[i, 0, 0]
        y = ((powers[i, 3, 1] * u + powers[i, 2, 1]) * u + powers[i, 1, 1]) * u + powers[i, 0, 1]
        z = ((powers[i, 3, 2] * u + powers[i, 2, 2]) * u + powers[i, 1, 2]) * u + powers[i, 0, 2]
        turned(R, turn_by(x * h, y * h, z * h), R)
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
        turned(turn, turn_by(share * missed[0], share * missed[1], share * missed[2]), turn)
        for r in range(3):
            for c in range(3):
                out[m, r, c] = (
                    R_k[k, r, 0] * turn[0, c]
                    + R_k[k, r, 1] * turn[1, c]
                    + R_k[k, r, 2] * turn[2, c]
                )
