"""What ArduPilot's EKF3 makes of errors of its sensors along a flight: how far its attitude is off.

An EKF turns by a gyroscope that is wrong, feels forces that are not there, is told velocities that
are late, and tilts until all of it fits together; part of it it learns as biases.  It is followed
once, batch by batch (:mod:`onboard.core.model.ekf3_filter`), for none of it depends on what is
estimated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from onboard.core.inputs.limits import FLYING_M_S
from onboard.core.inputs.segments import Batch, Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import rotation_from_euler, skew
from onboard.core.model.ekf3_filter import (
    ANTENNA,
    BETA,
    ERRORS,
    GRAVITY,
    GYRO_SCALE,
    LATENESS,
    MOVED,
    SCALE,
    SIZE,
    State,
    Steps,
)

TILTED: Final = "ekf3_attitude"
STATES: Final = "ekf3_states"
"""Names of what :func:`followed` tells, among the slow signals of a segment."""

BEGINS: Final = np.repeat([0.1, 0.3, 0.5, 0.2, 0.005], 3)
"""Sigmas with which it begins [physics]."""
SETTLED_S: Final = 60.0
"""It has been at rest for as long where a flight begins [physics: its own checks take half]; pauses
in the air are shorter."""

STEP_S: Final = 0.1
"""s; attitudes are taken so far apart, within which nothing of an EKF moves [cost]."""
KEPT_S: Final = 3.0
"""s before the end of a segment, within which the next one begins: samples are needed for 2.1."""
FEWEST: Final = 2
"""Attitudes, without which there is no step."""
KEPT_STEPS: Final = 5
"""From one state that is kept there to the next [cost]."""


def along(
    known: Sequence[Batch], run: Sequence[Batch], earlier: Sequence[Batch] = ()
) -> list[Batch]:
    """An uninterrupted flight with what :func:`followed` tells among its slow signals.

    Args:
        known: what this has given of it.
        run: the same and more, or anew where attitudes have changed.
        earlier: flight before the interruption.
    """
    out: list[Batch] = []
    paused = earlier[-1].segment.slow if earlier and _flew_on(earlier[-1], run[0]) else {}
    for i, batch in enumerate(run):
        if i < len(known) and known[i] is batch:
            out.append(batch)
            continue
        before = out[-1].segment.slow if out else paused
        told = followed(batch.segment, before)
        if out:
            out[-1] = _with(out[-1], {name: x for name, x in before.items() if name != STATES})
        out.append(_with(batch, batch.segment.slow | told))
    return out


def _flew_on(before: Batch, after: Batch) -> bool:
    """Whether a vehicle was in the air between two parts of its flight, and so its EKF went on."""
    ends = before.fixes.v_n[-1], after.fixes.v_n[0]
    pause = after.segment.t[0] - before.segment.t[-1]
    fast = all(np.hypot(v[0], v[1]) > FLYING_M_S for v in ends)
    return fast and -KEPT_S < pause < SETTLED_S


def _with(batch: Batch, slow: dict[str, Signal]) -> Batch:
    return replace(batch, segment=batch.segment.with_slow(slow))


def followed(segment: Segment, before: Mapping[str, Signal]) -> dict[str, Signal]:
    """The attitude's errors along a segment, and states from which the next one goes on.

    Args:
        segment: samples.
        before: the same of the segment before; empty if it was at rest before this one.

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
) -> tuple[float, State, Signal]:
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
        return float(times[k]), State.unpacked(states[k]), (old[between], attitude[between])
    nothing = np.zeros(0), np.zeros((0, 3 * ERRORS))
    if len(times):
        return float(t[0]), State.unpacked(states[-1]), nothing
    nose = rotation_from_euler(0.0, 0.0, np.arctan2(R[1, 0], R[0, 0]))
    rested = State.unpacked(_at_rest(tuple(R_bs.ravel().tolist()))).turned(nose)
    return float(t[0]), rested, nothing


@lru_cache(maxsize=4)
def _at_rest(R_bs: tuple[float, ...]) -> Array:
    """The state of a filter that was levelled at rest, its nose to the north, packed."""
    n = round(SETTLED_S / STEP_S)
    board = np.reshape(R_bs, (3, 3))
    force = np.hstack([board * (-GRAVITY @ board), board])
    pushed = np.zeros((n, MOVED, ERRORS))
    pushed[:, 3:6, :6] = STEP_S * force
    x = np.zeros((SIZE, ERRORS))
    x[0, :6], x[1, :6] = force[1] / -GRAVITY[2], force[0] / GRAVITY[2]
    state = State(x, np.diag(BEGINS**2), np.zeros(3 * ERRORS), np.zeros(3 * ERRORS))
    still = np.broadcast_to(np.eye(3), (n, 3, 3))
    steps = Steps(np.full(n, STEP_S), still, np.zeros((n, 3)), pushed, np.zeros((n, 3, ERRORS)))
    return steps.through(state, [n])[1][0]


def _steps(segment: Segment, t: Array, R: Array) -> Steps:
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
    told_n = np.zeros((len(h), 3, ERRORS))
    told_n[..., LATENESS] = a_n[..., None]
    told_n[..., ANTENNA] = -mean @ skew(turn[:, 0] / h[:, None])
    return Steps(h, mean, a_n, pushed, told_n)


def _ends(t: Array) -> list[int]:
    """Steps after which states are kept: some before the end of times (n + 1,), and the end."""
    last = len(t) - 1
    first = max(1, int(np.searchsorted(t, t[-1] - KEPT_S)))
    return [*range(first, last, KEPT_STEPS), last]
