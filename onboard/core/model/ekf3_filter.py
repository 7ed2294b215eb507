"""A filter like ArduPilot's EKF3 in error form: what errors of its sensors do to its states.

Attitude, velocity and place, and biases of gyroscope and accelerometer.  All of it is linear in the
errors, with gains that depend on how it was flown but not on them: those of Riccati's equation
along the flight, for the noise that EKF3 believes in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, Self

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew
from onboard.core.maths.kalman_errors import FIRST, kalman_errors
from onboard.core.maths.leaky import leaky_integral
from onboard.core.model.sensor_errors import BETA, ERRORS, GRAVITY, Steps

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
BEGINS: Final = np.repeat([0.1, 0.3, 0.5, 0.2, 0.005], 3)
"""Sigmas with which it begins [physics]."""
SETTLED_S: Final = 60.0
"""It has been at rest for as long where a flight begins [physics: its own checks take half]; pauses
in the air are shorter."""
REST_STEP_S: Final = 0.1
"""Of its steps at rest, s [cost]."""


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
class Misled:
    """What errors that begin in flight do to an EKF's states, per unit of each of m errors.

    Attributes:
        x: (s, m) errors; velocity counts from what it was told.
        P: (s, s) its covariance.
        unshown: (3 m,) what it has corrected of its attitude and does not report yet, rad.
        off_n: (3, m) what velocities were too large by in the step before, NED, m/s.
    """

    x: Array
    P: Array
    unshown: Array
    off_n: Array

    @classmethod
    def nothing_yet(cls, states: Array, count: int) -> Self:
        """Of a filter in such states that has heard no error of ``count``."""
        x, P = np.zeros((SIZE, count)), State.unpacked(states).P
        return cls(x, P, np.zeros(3 * count), np.zeros((3, count)))


class Ekf3:
    """The filter."""

    def at_rest(self, R_bs: Array) -> Array:
        """After a minute at rest."""
        return _at_rest(tuple(R_bs.ravel().tolist()))

    def headed(self, states: Array, R: Array) -> Array:
        """The same with another heading: R (3, 3)."""
        turned = State.unpacked(states).turned(R)
        return turned.packed(turned.unshown, turned.told_n)

    def through(
        self, steps: Steps, states: Array, stop_after: Sequence[int]
    ) -> tuple[Array, list[Array]]:
        """The attitude before and after each step, and states after some."""
        state = State.unpacked(states)
        moves, noise, variance = _filter(steps)
        told_n = steps.told_n.reshape(len(steps.h), -1)
        slower = np.diff(np.vstack([state.told_n, told_n]), axis=0)
        pushed = np.zeros((len(steps.h), MOVED, ERRORS))
        pushed[:, :3] = steps.turned
        pushed[:, 3:6] = steps.force + slower.reshape(-1, 3, ERRORS)
        attitude, kept = [state.x[None, :FIRST].copy()], []
        for k, stop in pairwise([0, *stop_after]):
            cut = slice(k, stop)
            given = moves[cut], pushed[cut], noise[cut], OBSERVED, variance[cut]
            attitude.append(kalman_errors(*given, state.x, state.P))
            kept.append(state.packed(state.unshown, told_n[stop - 1]))
        whole = np.concatenate(attitude)
        corrected = (np.diff(whole, axis=0) - pushed[:, :3]).reshape(len(told_n), -1)
        t = np.concatenate([[0.0], np.cumsum(steps.h)])
        pole = np.full(corrected.shape[1], -1.0 / SHOWN_S)
        unshown = leaky_integral(t, corrected, pole, state.unshown)
        for stop, row in zip(stop_after, kept, strict=True):
            row[-2 * len(pole) : -len(pole)] = unshown[stop]
        return whole.reshape(unshown.shape) - unshown, kept

    def misled(self, steps: Steps, before: Misled, off_n: Array) -> tuple[Array, Misled]:
        """What velocities that are false, of places that are right, make of its attitude.

        Args:
            steps: n of them.
            before: what there is of it.
            off_n: (n, 3, m) what velocities are too large by, NED, m/s per unit.

        Returns:
            (n + 1, 3, m), NED, rad per unit, before and after each step; what there is of it then.
        """
        every = np.concatenate([before.off_n[None], off_n])
        pushed = np.zeros((len(steps.h), MOVED, off_n.shape[2]))
        # Counted from false velocities it is too slow, and its places move by what it is not.
        pushed[:, 3:6] = -np.diff(every, axis=0)
        pushed[:, 6:] = every[:-1] * steps.h[:, None, None]
        attitude, state = self._answer(steps, before, pushed)
        return attitude, replace(state, off_n=every[-1])

    def jumped(self, steps: Steps, before: Misled, after: Array) -> tuple[Array, Misled]:
        """The same of an offset (3,) that has jumped, in the steps that are ``after`` it, (n,)."""
        pushed = np.zeros((len(steps.h), MOVED, len(BETA)))
        pushed[:, 3:6] = steps.force[..., BETA] * after[:, None, None]
        return self._answer(steps, before, pushed)

    def _answer(self, steps: Steps, before: Misled, pushed: Array) -> tuple[Array, Misled]:
        """The attitude that it reports of what errors ``pushed`` (n, r, m) its states by."""
        moves, noise, variance = _filter(steps)
        x, P = before.x.copy(), before.P.copy()
        begun = x[None, :FIRST].copy()
        told = kalman_errors(moves, pushed, noise, OBSERVED, variance, x, P)
        whole = np.concatenate([begun, told])
        corrected = np.diff(whole, axis=0).reshape(len(told), -1)
        t = np.concatenate([[0.0], np.cumsum(steps.h)])
        pole = np.full(corrected.shape[1], -1.0 / SHOWN_S)
        unshown = leaky_integral(t, corrected, pole, before.unshown)
        return whole - unshown.reshape(whole.shape), Misled(x, P, unshown[-1], before.off_n)


@lru_cache(maxsize=4)
def _at_rest(R_bs: tuple[float, ...]) -> Array:
    """The state of a filter that was levelled at rest, its nose to the north, packed."""
    n = round(SETTLED_S / REST_STEP_S)
    steps = Steps.at_rest(np.reshape(R_bs, (3, 3)), n, REST_STEP_S)
    force = steps.force[0] / REST_STEP_S
    x = np.zeros((SIZE, ERRORS))
    x[0], x[1] = force[1] / -GRAVITY[2], force[0] / GRAVITY[2]
    nothing = np.zeros(3 * ERRORS)
    begun = State(x, np.diag(BEGINS**2), nothing, nothing)
    return Ekf3().through(steps, begun.packed(nothing, nothing), [n])[1][0]


def _filter(steps: Steps) -> tuple[Array, Array, Array]:
    """Of each step, what moves errors, noise, and variances of what is observed."""
    h = steps.h[:, None]
    push, R = skew(steps.f_n * h), steps.R * h[..., None]
    moves = np.zeros((len(h), MOVED, SIZE))
    moves[:, :3, 12:] = -R
    moves[:, 3:6, :3] = -push
    moves[:, 3:6, 9:12] = -R
    moves[:, 3:6, 12:] = 0.5 * push @ R
    moves[:, 6:, 3:6] = np.eye(3) * h[..., None]
    return moves, h * NOISE, SIGMA**2 * (FUSED_S / h)
