"""Rotation matrices of whole flights at once: arrays (n, 3, 3)."""

from __future__ import annotations

import math

import numpy as np

from sitl.builtin.smoothing import Array


def about_x(angle: Array) -> Array:
    """Rotation about x: (n,) rad to (n, 3, 3)."""
    return _about(angle, 1, 2)


def about_y(angle: Array) -> Array:
    """Rotation about y: (n,) rad to (n, 3, 3)."""
    return _about(angle, 2, 0)


def about_z(angle: Array) -> Array:
    """Rotation about z: (n,) rad to (n, 3, 3)."""
    return _about(angle, 0, 1)


def _about(angle: Array, i: int, j: int) -> Array:
    angle = np.atleast_1d(angle)
    c, s = np.cos(angle), np.sin(angle)
    R = np.zeros((*angle.shape, 3, 3))
    k = 3 - i - j
    R[:, k, k] = 1.0
    R[:, i, i] = R[:, j, j] = c
    R[:, i, j] = -s
    R[:, j, i] = s
    return R


def from_euler(roll: Array, pitch: Array, yaw: Array) -> Array:
    """``R_nb = Rz(yaw) Ry(pitch) Rx(roll)``."""
    return about_z(yaw) @ about_y(pitch) @ about_x(roll)


def to_euler(R_nb: Array) -> Array:
    """(..., 3, 3) to (..., 3): roll, pitch, yaw, rad."""
    roll = np.arctan2(R_nb[..., 2, 1], R_nb[..., 2, 2])
    pitch = -np.arcsin(np.clip(R_nb[..., 2, 0], -1.0, 1.0))
    yaw = np.arctan2(R_nb[..., 1, 0], R_nb[..., 0, 0])
    return np.stack([roll, pitch, yaw], axis=-1)


def from_vector(rotation: Array) -> Array:
    """Rodrigues' formula: rotation vectors (..., 3) to matrices (..., 3, 3)."""
    rotation = np.asarray(rotation, dtype=np.float64)
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    K = cross_matrix(rotation)
    small = angle < 1e-8
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0, np.sin(safe) / safe)
    b = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    eye: Array = np.eye(3) + a * K + b * (K @ K)
    return eye


def cross_matrix(v: Array) -> Array:
    """``[v x]``: (..., 3) to (..., 3, 3)."""
    K = np.zeros((*v.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2] = -v[..., 2], v[..., 1]
    K[..., 1, 0], K[..., 1, 2] = v[..., 2], -v[..., 0]
    K[..., 2, 0], K[..., 2, 1] = -v[..., 1], v[..., 0]
    return K


def rotate(R: Array, v: Array) -> Array:
    """``R v`` sample by sample: (n, 3, 3), (n, 3) to (n, 3)."""
    out: Array = np.einsum("nij,nj->ni", R, v)
    return out


def rotate_back(R: Array, v: Array) -> Array:
    """``R^T v`` sample by sample."""
    out: Array = np.einsum("nji,nj->ni", R, v)
    return out


def one_from_vector(v: Array) -> Array:
    """:func:`from_vector` of a single vector (3,), quick: called for every message."""
    x, y, z = v.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-8:
        a, b = 1.0, 0.5
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2
    return np.array(
        [
            [1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)],
        ]
    )


def one_to_euler(R_nb: Array) -> Array:
    """:func:`to_euler` of a single matrix."""
    (xx, _, _), (yx, _, _), (zx, zy, zz) = R_nb.tolist()
    pitch = -math.asin(min(1.0, max(-1.0, zx)))
    return np.array([math.atan2(zy, zz), pitch, math.atan2(yx, xx)])


def crossed(a: Array, b: Array) -> Array:
    """Cross products (n, 3), sample by sample; numpy's own takes four times as long."""
    out = np.empty_like(a)
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    out[:, 0] = ay * bz - az * by
    out[:, 1] = az * bx - ax * bz
    out[:, 2] = ax * by - ay * bx
    return out


def cross(a: Array, b: Array) -> Array:
    """Cross product of two single vectors; numpy's own is made for large arrays."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
