"""One step of the filter with the attitude that goes with it, as loops that numba compiles.

What :class:`~onboard.core.filter.whitening.WhiteningFilter` does in Python between calls of
:mod:`onboard.core.filter.loops`, equal to it to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.filter.loops import predict
from onboard.core.filter.state import ERRORS, MEASURED, STATES
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import part
from onboard.core.maths.earth import EARTH_RATE, SEMI_MAJOR_AXIS


@part
def mean(carried: Array, state: int, theta: Array) -> float:
    """A state of member 0 at ``theta``."""
    row = carried[0, state]
    x = row[0]
    for c in range(len(theta)):
        x -= row[c + 1] * theta[c]
    return float(x)


@part
def turn_by(x: float, y: float, z: float, R: Array) -> None:
    """``exp([x, y, z]) R`` in place: :func:`onboard.core.maths.small_turns.turn_by`."""
    angle2 = x * x + y * y + z * z
    s, c = 1.0, 0.5
    if angle2 >= 1e-8:
        angle = math.sqrt(angle2)
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    sx, sy, sz, cx, cy, cz = s * x, s * y, s * z, c * x, c * y, c * z
    for j in range(3):
        a, b, d = R[0, j], R[1, j], R[2, j]
        R[0, j] = (1.0 - cy * y - cz * z) * a + (cx * y - sz) * b + (cx * z + sy) * d
        R[1, j] = (cx * y + sz) * a + (1.0 - cx * x - cz * z) * b + (cy * z - sx) * d
        R[2, j] = (cx * z - sy) * a + (cy * z + sx) * b + (1.0 - cx * x - cy * y) * d


@part
def angle_of(R_attitude: Array, R_nb: Array, turned: Array) -> None:
    """Rotation vector from one attitude to the other, NED: ``small_turns.angle_of``."""
    M = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for n in range(3):
                M[i, j] += R_attitude[i, n] * R_nb[j, n]
    x, y, z = 0.5 * (M[2, 1] - M[1, 2]), 0.5 * (M[0, 2] - M[2, 0]), 0.5 * (M[1, 0] - M[0, 1])
    s = math.sqrt(x * x + y * y + z * z)
    longer = 1.0
    if s >= 1e-9:
        longer = math.atan2(s, 0.5 * (M[0, 0] + M[1, 1] + M[2, 2] - 1.0)) / s
    turned[0], turned[1], turned[2] = x * longer, y * longer, z * longer


@part
def _drive(
    before: Array,
    after: Array,
    shares: Array,
    shaken: Array,
    settled: Array,
    decay: Array,
    as_stated: float,
) -> None:
    """Add to a member's walks, before and after a step, as ``Variances.over``: all but them."""
    for i in range(3):
        more = 0.5 * shares[i] * shaken[i]
        before[i] += more
        after[i] += more
    for i in range(MEASURED - 1):
        driven = settled[i] * (1.0 - decay[i] * decay[i])
        if i < 3:
            driven *= as_stated
        after[ERRORS + i] += driven


@part
def carry(
    carried: Array,
    R_nb: Array,
    T: float,
    turn: Array,
    moved: Array,
    columns: Array,
    missed: Array,
    shaken: Array,
    latitude: float,
    theta: Array,
    walk: Array,
    settled: Array,
    times: Array,
    heading_time: Array,
    powers: Array,
    shares: Array,
    stated: float,
    gravity: float,
    earth: int,
) -> None:
    """One step of prediction, attitude included."""
    members = len(walk)
    fall, decay, w = np.zeros(MEASURED), np.ones((members, MEASURED)), np.zeros(3)
    if earth:
        north, east = mean(carried, 0, theta), mean(carried, 1, theta)
        down = mean(carried, 2, theta)
        c, s = math.cos(latitude), math.sin(latitude)
        w[0], w[1] = east / SEMI_MAJOR_AXIS, -north / SEMI_MAJOR_AXIS
        w[2] = -east * s / c / SEMI_MAJOR_AXIS
        x, y, z = 2.0 * EARTH_RATE * c + w[0], w[1], -2.0 * EARTH_RATE * s + w[2]
        fall[0], fall[1] = (z * east - y * down) * T, (x * down - z * north) * T
        gravity += y * north - x * east
        w[0] += EARTH_RATE * c
        w[2] -= EARTH_RATE * s
    fall[2], fall[3] = gravity * T, -0.5 * T * T * gravity
    colour, tilt = math.exp(-T / times[0]), math.exp(-T / times[1])
    swing = np.empty((members, 3))
    before, after = np.empty(walk.shape), np.empty(walk.shape)
    for b in range(members):
        x = T / heading_time[b]
        shrunk = math.exp(-x)
        decay[b, 0] = decay[b, 1] = decay[b, 2] = colour
        decay[b, 4] = decay[b, 5] = tilt
        decay[b, 6] = (1.0 + x) * shrunk
        swing[b, 0], swing[b, 1] = T * shrunk, -x / heading_time[b] * shrunk
        swing[b, 2] = (1.0 - x) * shrunk
        for i in range(STATES):
            before[b, i] = after[b, i] = 0.5 * T * walk[b, i]
        _drive(before[b], after[b], shares[b], shaken, settled[b], decay[b], stated ** powers[b, 1])
    predict(carried, R_nb, T, moved, columns, missed, fall, decay, swing, before, after)
    for i in range(3):
        a, b_, c_ = R_nb[i, 0], R_nb[i, 1], R_nb[i, 2]
        for j in range(3):
            R_nb[i, j] = a * turn[0, j] + b_ * turn[1, j] + c_ * turn[2, j]
    if earth:
        turn_by(-w[0] * T, -w[1] * T, -w[2] * T, R_nb)
