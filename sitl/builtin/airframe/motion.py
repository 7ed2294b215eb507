"""What a vehicle is told to do, before any wind: velocity over ground and heading, at 1 kHz."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe.wing_force import SLOWEST, climb_angle, from_wind_axes
from sitl.builtin.smoothing import DT, Array
from sitl.builtin.trajectory import Start, Trajectory, envelope

CLIMBING = 0.5
"""Vertical speed from which a plane has left the ground, m/s: more than what is noise."""
ROTATION_S = (0.8, 3.0)
"""How quickly and how slowly a plane goes from its wheels onto its wing, s."""
Flags = np.ndarray[Any, np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """n rows at 1 kHz.

    Attributes:
        v_n: (n, 3) velocity over ground, NED, m/s.
        yaw: (n,) heading of a multicopter, course of a plane, rad.
        bank: (n,) of a plane about its air velocity, rad: as a start, the forces decide.
        slip: (n,) sideslip of a plane, rad: where its nose points.  A multicopter is told neither.
        armed: (n,) whether motors may turn.
        landed: (n,) whether it stands.
        start: place and heading at the first row.
    """

    v_n: Array
    yaw: Array
    bank: Array
    slip: Array
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

    @property
    def aloft(self) -> Array:
        """(n,) of a plane: 0 where the wheels carry, 1 where the wing does.

        The wing carries all before it climbs, however soon after lift-off that is.
        """
        begin, end = self.in_air_s
        climbing = np.flatnonzero(~self.landed & (np.abs(self.v_n[:, 2]) > CLIMBING))
        first, last = (climbing[0] * DT, climbing[-1] * DT) if len(climbing) else (end, begin)
        rise, fall = (float(np.clip(t, *ROTATION_S)) for t in (first - begin, end - last))
        up = envelope(self.n, first - rise, np.inf, rise)
        return up * envelope(self.n, -np.inf, last + fall, fall)

    @classmethod
    def of_plane(cls, trajectory: Trajectory, wind_n: Array, start: Start) -> Motion:
        """Of a flight as :mod:`sitl.builtin.plane` makes it, in a wind of (n, 3) m/s."""
        bank, slip = leaning(trajectory.R_nb, trajectory.v_n - wind_n)
        course = np.arctan2(trajectory.R_nb[:, 1, 0], trajectory.R_nb[:, 0, 0])
        return cls(
            trajectory.v_n,
            np.unwrap(course),
            bank,
            slip,
            trajectory.armed,
            trajectory.landed,
            start,
        )


def leaning(R_nb: Array, air_n: Array) -> tuple[Array, Array]:
    """(n,) bank about the velocity through the air and (n,) sideslip, rad; none where it stands."""
    flies = np.linalg.norm(air_n, axis=1) > SLOWEST
    course = np.arctan2(air_n[:, 1], air_n[:, 0])
    W = rotation.about_z(course) @ rotation.about_y(climb_angle(air_n))
    u_b = rotation.rotate_back(R_nb, air_n)
    ahead = np.maximum(u_b[:, 0], SLOWEST)
    slip = np.arctan2(u_b[:, 1], ahead)
    rolled = np.swapaxes(W, 1, 2) @ R_nb @ from_wind_axes(np.arctan2(u_b[:, 2], ahead), slip)
    bank = np.arctan2(rolled[:, 2, 1], rolled[:, 1, 1])
    return np.where(flies, bank, 0.0), np.where(flies, slip, 0.0)
