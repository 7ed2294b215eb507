"""Where a recorded multicopter was, moment by moment, for an autopilot to be there again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin.airframe.motion import Motion
from sitl.builtin.smoothing import DT, Array
from sitl.errors import SitlError

CLEAR_M = 10.0
"""Height from which a recorded flight is followed: below it the autopilot takes off and lands."""
CLEAR_SHARE = 0.5
"""Of the highest point of a flight that hardly gets there."""
LEAST_S = 20.0
"""A shorter flight cannot be laid beside another."""


@dataclass(frozen=True, slots=True)
class Point:
    """One moment: NED from the place of take-off, m, m/s, m/s^2; rad, rad/s."""

    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    yaw: float
    yaw_rate: float


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The part of a motion that is well above the ground.

    Attributes:
        position, velocity, acceleration: (n, 3) NED from the place of take-off, SI.
        yaw, yaw_rate: (n,) rad, rad/s.
    """

    position: Array
    velocity: Array
    acceleration: Array
    yaw: Array
    yaw_rate: Array

    @classmethod
    def of(cls, motion: Motion) -> Course:
        """What of a motion can be followed.

        Raises:
            SitlError: it is never, or not for long, above the ground.
        """
        position = DT * np.cumsum(motion.v_n, axis=0)
        height = -position[:, 2]
        aloft = np.flatnonzero(height > min(CLEAR_M, CLEAR_SHARE * float(np.max(height))))
        if len(aloft) < 2 or (aloft[-1] - aloft[0]) * DT < LEAST_S:
            raise SitlError(f"it flies for less than {LEAST_S:.0f} s")
        part = slice(aloft[0], aloft[-1])
        position = position - np.array([*position[aloft[0], :2], 0.0])
        return cls(
            position[part],
            motion.v_n[part],
            np.gradient(motion.v_n, DT, axis=0)[part],
            motion.yaw[part],
            np.gradient(motion.yaw, DT)[part],
        )

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return len(self.yaw) * DT

    @property
    def start(self) -> Point:
        """Where it begins, at rest."""
        x, y, z = (float(p) for p in self.position[0])
        still = (0.0, 0.0, 0.0)
        return Point((x, y, z), still, still, float(self.yaw[0]), 0.0)

    def at(self, seconds: float) -> Point:
        """The moment so long after the start; the first or the last beyond the ends."""
        k = min(max(round(seconds / DT), 0), len(self.yaw) - 1)
        rows = (self.position[k], self.velocity[k], self.acceleration[k])
        position, velocity, acceleration = ((float(x), float(y), float(z)) for x, y, z in rows)
        return Point(position, velocity, acceleration, float(self.yaw[k]), float(self.yaw_rate[k]))
