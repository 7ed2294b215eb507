"""Rotations: Euler angles, rotation vectors, ArduPilot's level trim.

Conventions as in :mod:`onboard`: ``R_nb = Rz(yaw) Ry(pitch) Rx(roll)`` takes body (FRD)
components to NED.  Every function takes leading dimensions ``(...)`` and keeps them; a
rotation matrix is ``(..., 3, 3)``, a vector ``(..., 3)``, angles are radians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array, Vector3


def rotation_from_euler(roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> Array:
    """``Rz(yaw) Ry(pitch) Rx(roll)``, aerospace 3-2-1 order, as MAVLink's ATTITUDE means it.

    Args:
        roll: (...) rad; broadcast against the other two.
        pitch: (...) rad.
        yaw: (...) rad.

    Returns:
        (..., 3, 3) ``R_nb``.
    """
    r, p, y = (np.asarray(angle, dtype=np.float64) for angle in (roll, pitch, yaw))
    if not r.shape == p.shape == y.shape:
        r, p, y = np.broadcast_arrays(r, p, y)
    sr, cr, sp, cp, sy, cy = np.sin(r), np.cos(r), np.sin(p), np.cos(p), np.sin(y), np.cos(y)
    R = np.empty((*r.shape, 3, 3))
    R[..., 0, 0] = cy * cp
    R[..., 0, 1] = cy * sp * sr - sy * cr
    R[..., 0, 2] = cy * sp * cr + sy * sr
    R[..., 1, 0] = sy * cp
    R[..., 1, 1] = sy * sp * sr + cy * cr
    R[..., 1, 2] = sy * sp * cr - cy * sr
    R[..., 2, 0] = -sp
    R[..., 2, 1] = cp * sr
    R[..., 2, 2] = cp * cr
    return R


def euler_from_rotation(R_nb: ArrayLike) -> tuple[Array, Array, Array]:
    """Inverse of :func:`rotation_from_euler`: (roll, pitch, yaw), each (...), rad.

    At pitch +-90 deg roll and yaw are one angle; the split that comes out still gives the
    same matrix.
    """
    R = np.asarray(R_nb, dtype=np.float64)
    cos_pitch = np.hypot(R[..., 0, 0], R[..., 1, 0])
    pitch = np.arctan2(-R[..., 2, 0], cos_pitch)
    yaw = np.arctan2(R[..., 1, 0], R[..., 0, 0])
    # Roll from the y and z columns turned back by yaw: stays right where cos(pitch) vanishes.
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(
        s * R[..., 0, 2] - c * R[..., 1, 2],
        c * R[..., 1, 1] - s * R[..., 0, 1],
    )
    return roll, pitch, yaw


def skew(v: ArrayLike) -> Array:
    """(..., 3, 3) matrix of the cross product: ``skew(a) @ b = a x b``."""
    a = np.asarray(v, dtype=np.float64)
    S = np.zeros((*a.shape, 3))
    S[..., 0, 1], S[..., 0, 2] = -a[..., 2], a[..., 1]
    S[..., 1, 0], S[..., 1, 2] = a[..., 2], -a[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -a[..., 1], a[..., 0]
    return S


def cross(a: Array, b: Array) -> Array:
    """``a x b`` of vectors (..., 3): numpy's own takes ten times as long over a thousand."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def rotation_from_vector(phi: ArrayLike) -> Array:
    """Exponential of so(3): rotation by ``|phi|`` rad about ``phi`` (Rodrigues).

    Args:
        phi: (..., 3) rad.

    Returns:
        (..., 3, 3), to rounding also for ``phi`` of 0.
    """
    v = np.asarray(phi, dtype=np.float64)
    angle = np.sqrt(np.square(v).sum(axis=-1))
    half = 0.5 * angle
    # By way of the unit quaternion: its vector is ``phi`` times a factor that is smooth at zero.
    factor = np.full_like(angle, 0.5)
    np.divide(np.sin(half), angle, out=factor, where=angle > 0.0)
    w = 2.0 * np.cos(half)
    x, y, z = factor * v[..., 0], factor * v[..., 1], factor * v[..., 2]
    x2, y2, z2 = 2.0 * x, 2.0 * y, 2.0 * z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x, w * y, w * z
    R = np.empty((*v.shape, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = 1.0 - yy - zz, xy - wz, xz + wy
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = xy + wz, 1.0 - xx - zz, yz - wx
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = xz - wy, yz + wx, 1.0 - xx - yy
    return R


def quaternion_from_rotation(R: ArrayLike) -> Array:
    """(..., 4) unit quaternion w, x, y, z with w >= 0 (Shepperd 1978: largest of four pivots)."""
    M = np.asarray(R, dtype=np.float64)
    m00, m11, m22 = M[..., 0, 0], M[..., 1, 1], M[..., 2, 2]
    a, b, c = (
        M[..., 2, 1] - M[..., 1, 2],
        M[..., 0, 2] - M[..., 2, 0],
        M[..., 1, 0] - M[..., 0, 1],
    )
    p, q, r = (
        M[..., 0, 1] + M[..., 1, 0],
        M[..., 0, 2] + M[..., 2, 0],
        M[..., 1, 2] + M[..., 2, 1],
    )
    # Rows of 4 q q^T; each row is the quaternion times one of its own components.
    outer = np.stack(
        [
            np.stack([1 + m00 + m11 + m22, a, b, c], axis=-1),
            np.stack([a, 1 + m00 - m11 - m22, p, q], axis=-1),
            np.stack([b, p, 1 - m00 + m11 - m22, r], axis=-1),
            np.stack([c, q, r, 1 - m00 - m11 + m22], axis=-1),
        ],
        axis=-2,
    )
    pivot = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(outer, pivot[..., None, None], axis=-2)[..., 0, :]
    row = row / np.linalg.norm(row, axis=-1, keepdims=True)
    result: Array = np.where(row[..., :1] < 0, -row, row)
    return result


def rotation_from_quaternion(q: ArrayLike) -> Array:
    """(..., 3, 3) from a quaternion w, x, y, z (..., 4); it need not be normalised, only not 0."""
    a = np.asarray(q, dtype=np.float64)
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    S = skew(a[..., 1:])
    result: Array = np.eye(3) + 2 * a[..., :1, None] * S + 2 * (S @ S)
    return result


def vector_from_rotation(R: ArrayLike) -> Array:
    """Logarithm of SO(3): the ``phi`` (..., 3), ``|phi| <= pi``, of :func:`rotation_from_vector`.

    Through the quaternion, so that it keeps full accuracy near 0 and near pi, where the trace
    of ``R`` says nothing about the angle.  At pi exactly the sign of ``phi`` is arbitrary.
    """
    q = quaternion_from_rotation(R)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    small = sine < 1e-12
    result: Array = q[..., 1:] * np.where(small, 2.0, angle / np.where(small, 1.0, sine))
    return result


def interpolate_rotation(t: ArrayLike, t_k: ArrayLike, R_k: ArrayLike) -> Array:
    """Rotation at times ``t`` from samples, at constant angular rate between neighbours.

    Args:
        t: (n,) times wanted; before the first and after the last sample those are held.
        t_k: (m,) strictly increasing times of the samples, m >= 1.
        R_k: (m, 3, 3) rotations there.

    Returns:
        (n, 3, 3).
    """
    at, times = np.asarray(t, dtype=np.float64), np.asarray(t_k, dtype=np.float64)
    R = np.asarray(R_k, dtype=np.float64)
    if len(times) == 1:
        return np.broadcast_to(R[0], (*at.shape, 3, 3)).copy()
    rates = vector_from_rotation(np.swapaxes(R[:-1], -1, -2) @ R[1:])
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    share = np.clip((at - times[k]) / (times[k + 1] - times[k]), 0.0, 1.0)
    result: Array = R[k] @ rotation_from_vector(share[..., None] * rates[k])
    return result


def untrimmed_rotation(
    roll: ArrayLike,
    pitch: ArrayLike,
    yaw: ArrayLike,
    trim: Vector3 = (0.0, 0.0, 0.0),
    pitch_trim: float = 0.0,
) -> Array:
    """``R_nb`` of the accelerometer's body axes from a reported attitude, EKF2 and EKF3.

    The EKFs report ``euler(R_nb) - AHRS_TRIM`` *angle by angle* (getEulerAngles in
    AP_NavEKF3_Outputs.cpp), while the accelerometer is not trimmed.  That is not a rotation of
    the body: in a bank of 60 deg the two differ by the whole size of the trim.

    Args:
        roll: (...) as reported, rad.
        pitch: (...) as reported, rad.
        yaw: (...) as reported, rad.
        trim: AHRS_TRIM_X, _Y, _Z, rad.
        pitch_trim: PTCH_TRIM_DEG in rad.  Plane subtracts it from the pitch of the MAVLink
            message ATTITUDE (not from the log's ATT) unless FLIGHT_OPTIONS has bit 8.

    Returns:
        (..., 3, 3).
    """
    return rotation_from_euler(
        np.asarray(roll) + trim[0],
        np.asarray(pitch) + (trim[1] + pitch_trim),
        np.asarray(yaw) + trim[2],
    )


def untrimmed_rotation_dcm(
    roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike, trim: Vector3 = (0.0, 0.0, 0.0)
) -> Array:
    """The same where DCM reports the attitude (AHRS_EKF_TYPE 0, firmware before the EKFs).

    DCM does rotate: ``R_reported = R_nb R(trim)^T`` (AP_AHRS_DCM.cpp), undone exactly here.
    """
    result: Array = rotation_from_euler(roll, pitch, yaw) @ rotation_from_euler(*trim)
    return result


def untrimmed_rotation_quaternion(
    roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike, trim: Vector3 = (0.0, 0.0, 0.0)
) -> Array:
    """The same of the MAVLink message ATTITUDE_QUATERNION, its quaternion as angles.

    There the trim is a rotation vector of the body: ``R_reported = R_nb exp(-trim x)``
    (``_get_quaternion`` in AP_AHRS.cpp).
    """
    result: Array = rotation_from_euler(roll, pitch, yaw) @ rotation_from_vector(trim)
    return result
