"""What an autopilot makes of errors of its sensors along a flight: how far its attitude is off.

It turns by a gyroscope that is wrong, feels forces that are not there, is told velocities that are
late, and tilts until all of it fits together; part of it an EKF learns as biases
(:mod:`onboard.core.model.ekf3_filter`), which DCM cannot (:mod:`onboard.core.model.dcm_filter`).
Either is followed once, batch by batch, for none of it depends on what is estimated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from onboard.core.inputs.limits import FLYING_M_S
from onboard.core.inputs.reported_attitude import ReportedAttitude
from onboard.core.inputs.segments import Batch, Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import rotation_from_euler
from onboard.core.model.dcm_filter import Dcm
from onboard.core.model.ekf3_filter import SETTLED_S, Ekf3
from onboard.core.model.sensor_errors import ERRORS, AttitudeFilter, Steps

TILTED: Final = "autopilot_attitude"
STATES: Final = "autopilot_states"
"""Names of what :func:`followed` tells, among the slow signals of a segment."""

STEP_S: Final = 0.1
"""s; attitudes are taken so far apart, within which nothing of a filter moves [cost]."""
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
    """Whether a vehicle was in the air between two parts of its flight, and it went on."""
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
        before: the same of the segment before; empty if it was at rest before this one.  Of
            another filter's it takes nothing.

    Returns:
        By :data:`TILTED` (k, 3 m), NED, rad per unit of each error, and by :data:`STATES`; empty of
        a segment with hardly an attitude in it.
    """
    first, last = np.searchsorted(segment.t_attitude, segment.t[[0, -1]])
    inside = segment.t_attitude[first:last]
    if len(inside) < FEWEST:
        return {}
    R = segment.R_attitude[first:last]
    by = filter_of(segment)
    begun, states, (old, was) = _begin(by, inside, R[0], segment.R_bs, before)
    stride = max(1, round(STEP_S / float(np.median(np.diff(inside)))))
    chosen = slice(int(np.searchsorted(inside, begun)), None, stride)
    t = inside[chosen]
    if len(t) < FEWEST:
        return {}
    ends = _ends(t)
    attitude, kept = by.through(Steps.between(segment, t, R[chosen]), states, ends)
    return {
        TILTED: (np.concatenate([old, t]), np.concatenate([was, attitude.astype(np.float32)])),
        STATES: (t[ends], np.stack(kept)),
    }


def filter_of(segment: Segment) -> AttitudeFilter:
    """What the recorded attitude of a segment comes from."""
    reported = segment.R_attitude
    gain = reported.dcm_gain if isinstance(reported, ReportedAttitude) else None
    return Ekf3() if gain is None else Dcm(gain)


def _begin(
    by: AttitudeFilter, t: Array, R: Array, R_bs: Array, before: Mapping[str, Signal]
) -> tuple[float, Array, Signal]:
    """When steps begin, the states then, and what is known of the time before that.

    Args:
        by: what the attitude comes from.
        t: (k,) attitudes.
        R: (3, 3) the first.
        R_bs: (3, 3) board orientation.
        before: slow signals of the segment before.
    """
    rested = by.at_rest(R_bs)
    times, states = before.get(STATES, (np.zeros(0), np.zeros((0, len(rested)))))
    if states.shape[1] != len(rested):
        # AHRS_EKF_TYPE was changed in flight: those are the other filter's, and of this one, which
        # went on beside it, nothing is known.
        times, states = times[:0], states[:0]
    k = int(np.searchsorted(times, t[0]))
    if k < len(times):
        old, attitude = before[TILTED]
        between = slice(*np.searchsorted(old, [t[0], times[k]]))
        return float(times[k]), states[k], (old[between], attitude[between])
    nothing = np.zeros(0), np.zeros((0, 3 * ERRORS))
    if len(times):
        return float(t[0]), states[-1], nothing
    nose = rotation_from_euler(0.0, 0.0, np.arctan2(R[1, 0], R[0, 0]))
    return float(t[0]), by.headed(rested, nose), nothing


def _ends(t: Array) -> list[int]:
    """Steps after which states are kept: some before the end of times (n + 1,), and the end."""
    last = len(t) - 1
    first = max(1, int(np.searchsorted(t, t[-1] - KEPT_S)))
    return [*range(first, last, KEPT_STEPS), last]
