"""A filter like ArduPilot's EKF3 in error form: what errors of its sensors do to its states.

Attitude, velocity and place, and biases of gyroscope and accelerometer.  All of it is linear in the
errors, with gains that depend on how it was flown but not on them: those of Riccati's equation
along the flight, for the noise that EKF3 believes in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import skew
from onboard.core.maths.kalman_errors import FIRST, kalman_errors
from onboard.core.maths.leaky import leaky_integral

SCALE, BETA, LATENESS = [0, 1, 2], [3, 4, 5], [6]
GYRO_SCALE, ANTENNA = [7, 8, 9], [10, 11, 12]
"""Errors, by columns: what the accelerometer reads too much, by share (1) and at any force (m/s^2);
how much older velocities are than it takes them for (s); what the gyroscope reads too much (1); how
far the antenna is from where it takes it to be, body (m)."""
ERRORS: Final = 13
SIZE: Final = 15
"""States: attitude (rad), velocity (m/s) and place (m), NED; biases of accelerometer and gyroscope,
body."""
MOVED: Final = 9
"""Of which so many change between measurements."""
OBSERVED: Final = np.array([3, 4, 5, 6, 7, 8, 2], dtype=np.int64)
"""Velocity, place, heading."""

NOISE: Final = 0.012 * np.repeat([0.015, 0.35, 0.0, 0.02, 1e-3], 3) ** 2
"""What a second adds to variances: defaults of EK3_GYRO_P_NSE, _ACC_, _ABIAS_ and _GBIAS_P_NSE, in
steps of 12 ms [physics]."""
FUSED_S: Final = 0.2
"""From one velocity to the next that it fuses [physics: five a second is the usual rate]."""
SIGMA: Final = np.array([0.3, 0.3, 0.5, 0.5, 0.5, 2.0, 0.07])
"""Of what it observes, m/s, m and rad: EK3_VELNE_M_NSE, _VELD_, _POSNE_ and _ALT_M_NSE, below which
it takes no receiver's word, and a compass's 0.05 of a field of half a gauss ten times a second
[physics]."""
SHOWN_S: Final = 0.3
"""s in which what it reports takes over a correction: twice the delay of what it fuses, 0.12 to 0.2
[physics]."""
GRAVITY: Final = np.array([0.0, 0.0, STANDARD_GRAVITY])


@dataclass(slots=True)
class State:
    """An EKF's errors, per unit of each error of its sensors, and what its gains depend on.

    Attributes:
        x: (s, m) errors of its states; velocity and place in the columns of lateness and antenna
            count from those of a vehicle as late, and from those of the antenna.
        P: (s, s) its covariance.
        unshown: (3 m,) what it has corrected of its attitude and does not report yet, rad.
        told_n: (3 m,) how much too slow the velocities were in the step before that it was told,
            NED, m/s.
    """

    x: Array
    P: Array
    unshown: Array
    told_n: Array

    @classmethod
    def unpacked(cls, row: Array) -> Self:
        """From one row of numbers."""
        x, P, unshown, told_n = np.split(row, np.cumsum([SIZE * ERRORS, SIZE**2, 3 * ERRORS]))
        shape = SIZE, ERRORS
        return cls(x.reshape(shape).copy(), P.reshape(SIZE, SIZE).copy(), unshown, told_n)

    def packed(self, unshown: Array, told_n: Array) -> Array:
        """As one row, with these in the place of its own."""
        return np.concatenate([self.x.ravel(), self.P.ravel(), unshown, told_n])

    def turned(self, R: Array) -> Self:
        """The same with another heading: R (3, 3)."""
        block = np.kron(np.eye(3), R)
        both = np.zeros((SIZE, SIZE))
        both[:9, :9], both[9:, 9:] = block, np.eye(SIZE - 9)
        shown, told_n = ((R @ x.reshape(3, ERRORS)).ravel() for x in (self.unshown, self.told_n))
        return type(self)(both @ self.x, both @ self.P @ both.T, shown, told_n)


@dataclass(frozen=True, slots=True)
class Steps:
    """n steps in a row.

    Attributes:
        h: (n,) s.
        R: (n, 3, 3) mean attitude.
        a_n: (n, 3) mean acceleration, NED, m/s^2.
        pushed: (n, 9, m) what errors add to attitude, velocity and place.
        told_n: (n, 3, m) how much too slow velocities are that it is told, NED, m/s.
    """

    h: Array
    R: Array
    a_n: Array
    pushed: Array
    told_n: Array

    def through(self, state: State, stop_after: Sequence[int]) -> tuple[Array, list[Array]]:
        """The attitude that is reported, before and after each step, and states after some.

        Args:
            state: to begin with; its arrays go on to the end.
            stop_after: how many steps, in order, all of them at last.

        Returns:
            (n + 1, 3 m), and packed states.
        """
        moves, noise, variance = self._filter()
        pushed, told_n = self.pushed.copy(), self.told_n.reshape(len(self.h), -1)
        slower = np.diff(np.vstack([state.told_n, told_n]), axis=0)
        pushed[:, 3:6] += slower.reshape(self.told_n.shape)
        attitude, kept = [state.x[None, :FIRST].copy()], []
        for k, stop in pairwise([0, *stop_after]):
            cut = slice(k, stop)
            given = moves[cut], pushed[cut], noise[cut], OBSERVED, variance[cut]
            attitude.append(kalman_errors(*given, state.x, state.P))
            kept.append(state.packed(state.unshown, told_n[stop - 1]))
        whole = np.concatenate(attitude)
        corrected = (np.diff(whole, axis=0) - pushed[:, :3]).reshape(len(self.h), -1)
        t = np.concatenate([[0.0], np.cumsum(self.h)])
        pole = np.full(corrected.shape[1], -1.0 / SHOWN_S)
        unshown = leaky_integral(t, corrected, pole, state.unshown)
        for stop, row in zip(stop_after, kept, strict=True):
            row[-2 * len(pole) : -len(pole)] = unshown[stop]
        return whole.reshape(unshown.shape) - unshown, kept

    def _filter(self) -> tuple[Array, Array, Array]:
        """Of each step, what moves errors, noise, and variances of what is observed."""
        h = self.h[:, None]
        push, R = skew((self.a_n - GRAVITY) * h), self.R * h[..., None]
        moves = np.zeros((len(h), MOVED, SIZE))
        moves[:, :3, 12:] = -R
        moves[:, 3:6, :3] = -push
        moves[:, 3:6, 9:12] = -R
        moves[:, 3:6, 12:] = 0.5 * push @ R
        moves[:, 6:, 3:6] = np.eye(3) * h[..., None]
        return moves, h * NOISE, SIGMA**2 * (FUSED_S / h)
