"""Errors of the sensors that an autopilot finds its attitude with, and the steps that it flew.

Whatever filter it has, to first order its attitude errs by a sum of these, each with a course of
its own along the flight (:mod:`onboard.core.model.ekf3_filter`,
:mod:`onboard.core.model.dcm_filter`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol, Self

import numpy as np

from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import skew

SCALE, BETA, LATENESS = [0, 1, 2], [3, 4, 5], [6]
GYRO_SCALE, ANTENNA = [7, 8, 9], [10, 11, 12]
"""Errors, by columns: what the accelerometer reads too much, by share (1) and at any force (m/s^2);
how much older velocities are than it takes them for (s); what the gyroscope reads too much (1); how
far the antenna is from where it takes it to be, body (m)."""
ERRORS: Final = 13
GRAVITY: Final = np.array([0.0, 0.0, STANDARD_GRAVITY])


@dataclass(frozen=True, slots=True)
class Steps:
    """n steps in a row between attitudes.

    Attributes:
        h: (n,) s.
        R: (n, 3, 3) mean attitude.
        turn: (n, 3) by the gyroscope, body, rad.
        gained: (n, 3) by the accelerometer, sensor axes, m/s.
        R_bs: (3, 3) board orientation.
    """

    h: Array
    R: Array
    turn: Array
    gained: Array
    R_bs: Array

    @classmethod
    def between(cls, segment: Segment, t: Array, R: Array) -> Self:
        """Between attitudes R (n + 1, 3, 3) at ``t`` (n + 1,), from a segment's samples."""
        x = np.hstack([segment.raw_s, segment.w_b])
        width = np.diff(segment.t)[:, None]
        total = np.vstack([np.zeros(6), np.cumsum(0.5 * width * (x[1:] + x[:-1]), axis=0)])
        both = np.diff([np.interp(t, segment.t, column) for column in total.T]).T
        mean = 0.5 * (R[1:] + R[:-1])
        return cls(np.diff(t), mean, both[:, 3:], both[:, :3], segment.R_bs)

    @classmethod
    def at_rest(cls, R_bs: Array, count: int, step: float) -> Self:
        """``count`` steps of ``step`` s, level, the nose to the north."""
        still = np.zeros((count, 3))
        gained = np.broadcast_to(-step * GRAVITY @ R_bs, (count, 3))
        axes = np.broadcast_to(np.eye(3), (count, 3, 3))
        return cls(np.full(count, step), axes, still, gained, R_bs)

    @property
    def force(self) -> Array:
        """(n, 3, m) what errors add to the velocity, NED, m/s."""
        out = np.zeros((len(self.h), 3, ERRORS))
        board = self.R @ self.R_bs
        out[..., SCALE] = board * self.gained[:, None]
        out[..., BETA] = board * self.h[:, None, None]
        return out

    @property
    def turned(self) -> Array:
        """(n, 3, m) what errors add to the attitude, NED, rad."""
        out = np.zeros((len(self.h), 3, ERRORS))
        out[..., GYRO_SCALE] = self.R * self.turn[:, None]
        return out

    @property
    def f_n(self) -> Array:
        """(n, 3) mean specific force, NED, m/s^2."""
        out: Array = np.einsum("nij,nj->ni", self.R @ self.R_bs, self.gained) / self.h[:, None]
        return out

    @property
    def told_n(self) -> Array:
        """(n, 3, m) how much too slow the velocities are that it is told, NED, m/s."""
        out = np.zeros((len(self.h), 3, ERRORS))
        out[..., LATENESS] = (self.f_n + GRAVITY)[..., None]
        out[..., ANTENNA] = -self.R @ skew(self.turn / self.h[:, None])
        return out


class AttitudeFilter(Protocol):
    """How an autopilot finds its attitude: what its states err by, packed in rows of numbers."""

    def at_rest(self, R_bs: Array) -> Array:
        """The states of one that was levelled at rest, its nose to the north.

        Args:
            R_bs: (3, 3) board orientation.
        """
        ...

    def headed(self, states: Array, R: Array) -> Array:
        """The same with another heading: R (3, 3)."""
        ...

    def through(
        self, steps: Steps, states: Array, stop_after: Sequence[int]
    ) -> tuple[Array, list[Array]]:
        """The attitude that is reported, before and after each step, and states after some.

        Args:
            steps: n of them.
            states: to begin with.
            stop_after: how many steps, in order, all of them at last.

        Returns:
            (n + 1, 3 m), NED, rad per unit of each error, and packed states.
        """
        ...
