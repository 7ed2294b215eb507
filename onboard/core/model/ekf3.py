"""What ArduPilot's EKF3 makes of errors of its sensors: how far its attitude is off.

An EKF turns by a gyroscope that is wrong, feels forces that are not there, is told velocities that
are late, and tilts until all of it fits together; part of it it learns as biases.  All that is
linear in the errors, with gains that depend on how it was flown but not on the errors: those of
Riccati's equation along the flight, for the noise that EKF3 believes in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, Self

import numpy as np

from onboard.core.inputs.segments import Batch, Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_euler, skew
from onboard.core.maths.kalman_errors import FIRST, kalman_errors
from onboard.core.maths.leaky import leaky_integral

TILTED: Final = "ekf3_attitude"
STATES: Final = "ekf3_states"
"""Names of what :func:`followed` tells, among the slow signals of a segment."""

SCALE, BETA, LATENESS, GYRO_SCALE = [0, 1, 2], [3, 4, 5], [6], [7, 8, 9]
"""Errors, by columns: what the accelerometer reads too much, by share (1) and at any force (m/s^2);
how much older velocities are than it takes them for (s); what the gyroscope reads too much (1)."""
ERRORS: Final = 10
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
"""It has been at rest for as long where a flight begins [physics: its own checks take half]."""

GRAVITY: Final = np.array([0.0, 0.0, STANDARD_GRAVITY])

STEP_S: Final = 0.1
"""s; attitudes are taken so far apart, within which nothing of an EKF moves [cost]."""
KEPT_S: Final = 3.0
"""s before the end of a segment, within which the next one begins: samples are needed for 2.1."""
FEWEST: Final = 2
"""Attitudes, without which there is no step."""
KEPT_STEPS: Final = 5
"""From one state that is kept there to the next [cost]."""


@dataclass(slots=True)
class _State:
    """An EKF's errors, per unit of each error of its sensors, and what its gains depend on.

    Attributes:
        x: (s, m) errors of its states; velocity and place in the column of the lateness count from
            those of a vehicle as late.
        P: (s, s) its covariance.
        unshown: (3, m) what it has corrected of its attitude and does not report yet, rad.
        a_n: (3,) mean acceleration of the step before, NED, m/s^2.
    """

    x: Array
    P: Array
    unshown: Array
    a_n: Array

    @classmethod
    def unpacked(cls, row: Array) -> Self:
        """From one row of numbers."""
        x, P, unshown, a_n = np.split(row, np.cumsum([SIZE * ERRORS, SIZE**2, 3 * ERRORS]))
        shape = SIZE, ERRORS
        return cls(x.reshape(shape).copy(), P.reshape(SIZE, SIZE).copy(), unshown, a_n)

    def packed(self, unshown: Array, a_n: Array) -> Array:
        """As one row, with these in the place of its own."""
        return np.concatenate([self.x.ravel(), self.P.ravel(), unshown, a_n])

    def turned(self, R: Array) -> Self:
        """The same with another heading: R (3, 3)."""
        block = np.kron(np.eye(3), R)
        both = np.zeros((SIZE, SIZE))
        both[:9, :9], both[9:, 9:] = block, np.eye(SIZE - 9)
        shown = (R @ self.unshown.reshape(3, ERRORS)).ravel()
        return type(self)(both @ self.x, both @ self.P @ both.T, shown, R @ self.a_n)


@dataclass(frozen=True, slots=True)
class _Steps:
    """n steps in a row.

    Attributes:
        h: (n,) s.
        R: (n, 3, 3) mean attitude.
        a_n: (n, 3) mean acceleration, NED, m/s^2.
        pushed: (n, 9, m) what errors add to attitude, velocity and place.
    """

    h: Array
    R: Array
    a_n: Array
    pushed: Array

    def through(self, state: _State, stop_after: Sequence[int]) -> tuple[Array, list[Array]]:
        """The attitude that is reported, before and after each step, and states after some.

        Args:
            state: to begin with; its arrays go on to the end.
            stop_after: how many steps, in order, all of them at last.

        Returns:
            (n + 1, 3 m), and packed states.
        """
        moves, noise, variance = self._filter()
        late = np.diff(np.vstack([state.a_n, self.a_n]), axis=0)
        self.pushed[:, 3:6, LATENESS] += late[..., None]
        attitude, kept = [state.x[None, :FIRST].copy()], []
        for k, stop in pairwise([0, *stop_after]):
            cut = slice(k, stop)
            given = moves[cut], self.pushed[cut], noise[cut], OBSERVED, variance[cut]
            attitude.append(kalman_errors(*given, state.x, state.P))
            kept.append(state.packed(state.unshown, self.a_n[stop - 1]))
        whole = np.concatenate(attitude)
        corrected = (np.diff(whole, axis=0) - self.pushed[:, :3]).reshape(len(self.h), -1)
        t = np.concatenate([[0.0], np.cumsum(self.h)])
        pole = np.full(corrected.shape[1], -1.0 / SHOWN_S)
        unshown = leaky_integral(t, corrected, pole, state.unshown)
        for stop, row in zip(stop_after, kept, strict=True):
            row[-3 - len(pole) : -3] = unshown[stop]
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


def along(known: Sequence[Batch], run: Sequence[Batch]) -> list[Batch]:
    """An uninterrupted flight with what :func:`followed` tells among its slow signals.

    Args:
        known: what this has given of it.
        run: the same and more, or anew where attitudes have changed.
    """
    out: list[Batch] = []
    for i, batch in enumerate(run):
        if i < len(known) and known[i] is batch:
            out.append(batch)
            continue
        before = out[-1].segment.slow if out else {}
        told = followed(batch.segment, before)
        if out:
            out[-1] = _with(out[-1], {name: x for name, x in before.items() if name != STATES})
        out.append(_with(batch, batch.segment.slow | told))
    return out


def _with(batch: Batch, slow: dict[str, Signal]) -> Batch:
    return replace(batch, segment=replace(batch.segment, slow=slow))


def followed(segment: Segment, before: Mapping[str, Signal]) -> dict[str, Signal]:
    """The attitude's errors along a segment, and states from which the next one goes on.

    Args:
        segment: samples.
        before: the same of the segment before; empty after a gap.

    Returns:
        By :data:`TILTED` (k, 3 m), NED, rad per unit of each error, and by :data:`STATES`; empty of
        a segment with hardly an attitude in it.
    """
    first, last = np.searchsorted(segment.t_attitude, segment.t[[0, -1]])
    inside = segment.t_attitude[first:last]
    if len(inside) < FEWEST:
        return {}
    R = segment.R_attitude[first:last]
    begun, state, (old, was) = _begin(inside, R[0], segment.R_bs, before)
    stride = max(1, round(STEP_S / float(np.median(np.diff(inside)))))
    chosen = slice(int(np.searchsorted(inside, begun)), None, stride)
    t = inside[chosen]
    if len(t) < FEWEST:
        return {}
    ends = _ends(t)
    attitude, states = _steps(segment, t, R[chosen]).through(state, ends)
    return {
        TILTED: (np.concatenate([old, t]), np.concatenate([was, attitude.astype(np.float32)])),
        STATES: (t[ends], np.stack(states)),
    }


def _begin(
    t: Array, R: Array, R_bs: Array, before: Mapping[str, Signal]
) -> tuple[float, _State, Signal]:
    """When steps begin, the state then, and what is known of the time before that.

    Args:
        t: (k,) attitudes.
        R: (3, 3) the first.
        R_bs: (3, 3) board orientation.
        before: slow signals of the segment before.
    """
    times, states = before.get(STATES, (np.zeros(0), np.zeros((0, 0))))
    k = int(np.searchsorted(times, t[0]))
    if k < len(times):
        old, attitude = before[TILTED]
        between = slice(*np.searchsorted(old, [t[0], times[k]]))
        return float(times[k]), _State.unpacked(states[k]), (old[between], attitude[between])
    nose = rotation_from_euler(0.0, 0.0, np.arctan2(R[1, 0], R[0, 0]))
    rested = _State.unpacked(_at_rest(tuple(R_bs.ravel().tolist()))).turned(nose)
    return float(t[0]), rested, (np.zeros(0), np.zeros((0, 3 * ERRORS)))


@lru_cache(maxsize=4)
def _at_rest(R_bs: tuple[float, ...]) -> Array:
    """The state of a filter that was levelled at rest, its nose to the north, packed."""
    n = round(SETTLED_S / STEP_S)
    board = np.reshape(R_bs, (3, 3))
    force = np.hstack([board * (-GRAVITY @ board), board])
    pushed = np.zeros((n, MOVED, ERRORS))
    pushed[:, 3:6, :6] = STEP_S * force
    x = np.zeros((SIZE, ERRORS))
    x[0, :6], x[1, :6] = force[1] / -STANDARD_GRAVITY, force[0] / STANDARD_GRAVITY
    state = _State(x, np.diag(BEGINS**2), np.zeros(3 * ERRORS), np.zeros(3))
    still = np.broadcast_to(np.eye(3), (n, 3, 3))
    steps = _Steps(np.full(n, STEP_S), still, np.zeros((n, 3)), pushed)
    return steps.through(state, [n])[1][0]


def _steps(segment: Segment, t: Array, R: Array) -> _Steps:
    """Between attitudes R (n + 1, 3, 3) at ``t`` (n + 1,), from the samples."""
    h, mean = np.diff(t), 0.5 * (R[1:] + R[:-1])
    x = np.hstack([segment.raw_s, segment.w_b])
    width = np.diff(segment.t)[:, None]
    total = np.vstack([np.zeros(6), np.cumsum(0.5 * width * (x[1:] + x[:-1]), axis=0)])
    gained = np.diff([np.interp(t, segment.t, column) for column in total.T]).T
    raw, turn = gained[:, None, :3], gained[:, None, 3:]
    board = mean @ segment.R_bs
    pushed = np.zeros((len(h), MOVED, ERRORS))
    pushed[:, :3, GYRO_SCALE] = mean * turn
    pushed[:, 3:6, SCALE] = board * raw
    pushed[:, 3:6, BETA] = board * h[:, None, None]
    a_n = pushed[:, 3:6, SCALE].sum(axis=2) / h[:, None] + GRAVITY
    return _Steps(h, mean, a_n, pushed)


def _ends(t: Array) -> list[int]:
    """Steps after which states are kept: some before the end of times (n + 1,), and the end."""
    last = len(t) - 1
    first = max(1, int(np.searchsorted(t, t[-1] - KEPT_S)))
    return [*range(first, last, KEPT_STEPS), last]
