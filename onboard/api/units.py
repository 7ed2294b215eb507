"""Are these the units and frames that were meant?  Physics says so, whoever made the columns."""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import (
    interpolate_rotation,
    rotation_from_euler,
    vector_from_rotation,
)
from onboard.errors import ArraysError
from onboard.recordings.table_cells import FEWEST_ROWS

LONGEST_STEP_S: Final = 1.0
"""Median, between two inertial samples: slower ones are not estimated from."""
SHORTEST_STEP_S: Final = 1e-5
FORCE: Final = (3.0, 40.0)
"""Median length of specific force, m/s^2: a vehicle in flight feels about one gravity [physics]."""
FASTEST_M_S: Final = 500.0
GRAVITY_OFF: Final = 4.0
"""m/s^2, of the mean force along down from minus gravity: over a flight accelerations cancel."""
TURNS: Final = (0.3, 3.0)
"""How many times as fast as the attitude a gyroscope may turn; degrees are 57 times as many."""
LONGEST_TURN_S: Final = 0.5
LEAST_TURN: Final = 0.02
"""rad/s, root mean square: less tells nothing of a unit."""


def check_rows(name: str, rows: int) -> None:
    """Enough rows to be a flight.

    Raises:
        ArraysError: there are too few.
    """
    if rows < FEWEST_ROWS:
        raise ArraysError(f"{name}: {rows} rows are too few for a flight")


def check_clock(name: str, t: Array) -> None:
    """Times of inertial samples in seconds.

    Raises:
        ArraysError: too few, or too far apart or too close for seconds.
    """
    check_rows(name, len(t))
    step = float(np.median(np.diff(t)))
    if not SHORTEST_STEP_S < step < LONGEST_STEP_S:
        raise ArraysError(f"{name}: samples are {step:.3g} apart: times have to be in seconds")


def check_force(name: str, f_b: Array) -> None:
    """Specific force in m/s^2, gravity's reaction included.

    Raises:
        ArraysError: its median is not about one gravity.
    """
    length = np.linalg.norm(f_b, axis=1)
    length = length[np.isfinite(length)]
    if not length.size:
        raise ArraysError(f"{name}: holds no number")
    typical = float(np.median(length))
    if not FORCE[0] < typical < FORCE[1]:
        raise ArraysError(
            f"{name}: its median length is {typical:.3g}, expected about 9.8 m/s^2 with gravity in "
            "it"
        )


def check_angles(name: str, angles: Array, most: float) -> None:
    """Angles in radians.

    Raises:
        ArraysError: one is larger than ``most``.
    """
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    if largest > most * (1.0 + 1e-6):
        raise ArraysError(f"{name}: reaches {largest:.4g}: angles have to be in radians")


def check_velocity(name: str, v_n: Array) -> None:
    """Velocity in m/s.

    Raises:
        ArraysError: a twentieth of it is faster than anything that flies here.
    """
    speed = np.linalg.norm(np.nan_to_num(v_n), axis=1)
    fast = float(np.percentile(speed, 95)) if speed.size else 0.0  # a few false fixes are no unit
    if fast > FASTEST_M_S:
        raise ArraysError(f"{name}: its speed comes to {fast:.4g}: velocities have to be in m/s")


def check_together(t: Array, euler: Array, t_f: Array, f_b: Array, w_b: Array | None) -> None:
    """Attitude, force and rates are of one vehicle and in the same frames.

    Args:
        t: (n,) times of the attitude, s.
        euler: (n, 3) roll, pitch, yaw, rad.
        t_f: (m,) times of the inertial samples, s.
        f_b: (m, 3) specific force, m/s^2.
        w_b: (m, 3) angular rate, rad/s, or None.

    Raises:
        ArraysError: gravity does not come out, or the gyroscope turns otherwise than the attitude.
    """
    known = np.isfinite(euler).all(axis=1)
    R_nb = rotation_from_euler(*euler[known].T)
    within = np.isfinite(f_b).all(axis=1) & (t_f >= t[0]) & (t_f <= t[-1])
    R_at = interpolate_rotation(t_f[within], t[known], R_nb)
    down = float(np.einsum("nj,nj->n", R_at[:, 2, :], f_b[within]).mean())
    if abs(down + STANDARD_GRAVITY) > GRAVITY_OFF:
        said = f"turned by the attitude, f_b has a mean of {down:.2f} m/s^2 along down"
        raise ArraysError(f"{said}, expected -9.8: is it forward, right, down, as measured?")
    if w_b is None:
        return
    step = np.diff(t[known])
    near = (step > 0.0) & (step < LONGEST_TURN_S)
    if np.count_nonzero(near) < FEWEST_ROWS:
        return
    turned = vector_from_rotation(np.swapaxes(R_nb[:-1], -1, -2)[near] @ R_nb[1:][near])
    turning = turned / step[near][:, None]
    middle = t[known][:-1][near] + 0.5 * step[near]
    there = np.isfinite(w_b).all(axis=1)
    told = np.column_stack([np.interp(middle, t_f[there], w_b[there, k]) for k in range(3)])
    power = float(np.mean(np.sum(turning**2, axis=1)))
    times = float(np.mean(np.sum(turning * told, axis=1))) / max(power, 1e-12)
    if power > LEAST_TURN**2 and not TURNS[0] < times < TURNS[1]:
        raise ArraysError(
            f"w_b turns {times:.3g} times as fast as the attitude: is it rad/s, forward, right, "
            "down?"
        )
