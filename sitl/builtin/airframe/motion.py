"""What a vehicle is told to do, before any wind: velocity over ground and heading, at 1 kHz."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe.wing_force import SLOWEST, climb_angle, from_wind_axes
from sitl.builtin.smoothing import DT, Array
from sitl.builtin.trajectory import Start, Trajectory

Flags = np.ndarray[Any, np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """n rows at 1 kHz.

    Attributes:
        v_n: (n, 3) velocity over ground, NED, m/s.
        yaw: (n,) heading of a multicopter, course of a plane, rad.
        bank: (n,) of a plane about its air velocity, rad; a multicopter is told none.
        armed: (n,) whether motors may turn.
        landed: (n,) whether it stands.
        start: place and heading at the first row.
    """

    v_n: Array
    yaw: Array
    bank: Array
    armed: Flags
    landed: Flags
    start: Start

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.yaw)

    @property
    def in_air_s(self) -> tuple[float, float]:
        """When it lifts off and touches down, s; both the end if it never flies."""
        flying = np.flatnonzero(~self.landed)
        if not len(flying):
            return self.n * DT, self.n * DT
        return float(flying[0] * DT), float((flying[-1] + 1) * DT)

    @classmethod
    def of_plane(cls, trajectory: Trajectory, wind_n: Array, start: Start) -> Motion:
        """Of a flight as :mod:`sitl.builtin.plane` makes it, in a wind of (n, 3) m/s."""
        bank = bank_of(trajectory.R_nb, trajectory.v_n - wind_n)
        course = np.arctan2(trajectory.R_nb[:, 1, 0], trajectory.R_nb[:, 0, 0])
        return cls(
            trajectory.v_n, np.unwrap(course), bank, trajectory.armed, trajectory.landed, start
        )


def bank_of(R_nb: Array, air_n: Array) -> Array:
    """(n,) how far a body is rolled about its velocity through the air; none where it stands."""
    speed = np.linalg.norm(air_n, axis=1)
    course = np.arctan2(air_n[:, 1], air_n[:, 0])
    W = rotation.about_z(course) @ rotation.about_y(climb_angle(air_n))
    u_b = rotation.rotate_back(R_nb, air_n)
    ahead = np.maximum(u_b[:, 0], SLOWEST)
    B = from_wind_axes(np.arctan2(u_b[:, 2], ahead), np.arctan2(u_b[:, 1], ahead))
    rolled = np.swapaxes(W, 1, 2) @ R_nb @ B
    angle = np.arctan2(rolled[:, 2, 1], rolled[:, 1, 1])
    return np.where(speed > SLOWEST, angle, 0.0)
