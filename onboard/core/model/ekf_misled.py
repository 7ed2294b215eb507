"""What an EKF makes of what begins in flight: velocities that are false, an offset that jumps.

A receiver that is off by a metre a second is within the gates of an EKF, which tilts until its
accelerometer agrees.  Fixes that are known to be false are not fitted, but the recorded attitude
has seen them, and were it held for right, it would be held against the accelerometer.

An offset that jumps tilts it too, until it has learned the new one.  Were the tilt held for right,
as much of the jump would be missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from onboard.core.inputs.segments import Batch, Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import rotation_from_euler
from onboard.core.model.around import Around
from onboard.core.model.autopilot_attitude import STEP_S, filter_of
from onboard.core.model.ekf3_filter import Ekf3, Misled
from onboard.core.model.nuisances import AXIS
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown
from onboard.core.model.sensor_errors import Steps

AXES: Final = ("north", "east")
"""Of a vertical velocity that is false nothing tilts, to first order."""


class _Answer(Family):
    """Errors of the recorded attitude that an EKF makes of others, which begin in flight."""

    def attitude(self, around: Around) -> Direct:
        """Of these errors."""
        told = around.now.slow(self.name)
        if told is None:
            return NOTHING
        return Direct(ned=told.reshape(-1, 3, len(self.unknowns)))

    def along(self, batches: Sequence[Batch]) -> list[Batch]:
        """A flight with what its EKF has made of them among its slow signals."""
        out: list[Batch] = []
        state: Misled | None = None
        before: Signal | None = None
        for batch in batches:
            segment = batch.segment
            if before is not None and segment.t[0] < before[0][0]:
                state = before = None  # the clock began anew
            t, R = _attitudes(segment, before)
            if isinstance(by := filter_of(segment), Ekf3) and len(t) > 1:
                state = state or _settled(by, segment, R[0], len(self.unknowns))
                x, state = self._through(by, Steps.between(segment, t, R), state, t[1:])
                before = _joined(before, (t, x.reshape(len(t), -1)), segment.t[0])
                segment = segment.with_slow({**segment.slow, self.name: before})
            out.append(replace(batch, segment=segment))
        return out

    def _through(self, by: Ekf3, steps: Steps, state: Misled, t: Array) -> tuple[Array, Misled]:
        """Its attitude (n + 1, 3, m) over n steps that end at ``t``, and states at their end."""
        raise NotImplementedError  # abstract: each error drives the EKF in its own way


class EkfMisled(_Answer):
    """Of velocities that were false from one moment to another.

    A nuisance, north and east for each: an EKF believes all of an error, or refuses it, or takes
    some of it, so that each is as large as the error at most, and nothing beforehand.
    """

    name = "ekf_misled"

    def __init__(self, intervals: Sequence[tuple[float, float]], size: float) -> None:
        """Take from when to when velocities were false, s on the boot clock, and by what, m/s."""
        self.intervals = tuple(intervals)
        self.unknowns = tuple(
            Unknown(f"ekf_misled_{i}_{axis}", "m/s", 0.0, size)
            for i in range(len(self.intervals))
            for axis in AXES
        )

    def _through(self, by: Ekf3, steps: Steps, state: Misled, t: Array) -> tuple[Array, Misled]:
        inside = np.stack([(t >= a) & (t <= b) for a, b in self.intervals], axis=-1)
        each = inside[:, None, :, None] * np.eye(3)[:, None, : len(AXES)]
        return by.misled(steps, state, each.reshape(len(t), 3, -1).astype(np.float64))


class EkfJumped(_Answer):
    """Of an offset that jumped at one moment.

    A nuisance of its own beside the jump: which accelerometer an EKF uses a recording need not
    tell.
    """

    def __init__(self, moment: float, sigma: Array) -> None:
        """Take the moment, s on the boot clock, and prior sigmas of the jump (3,), m/s^2."""
        self.moment = moment
        self.name = f"ekf_jumped_{moment:.3f}"
        each = zip(AXIS, sigma.tolist(), strict=True)
        self.unknowns = tuple(Unknown(f"{self.name}_{a}", "m/s^2", 0.0, s) for a, s in each)

    def _through(self, by: Ekf3, steps: Steps, state: Misled, t: Array) -> tuple[Array, Misled]:
        return by.jumped(steps, state, (t > self.moment).astype(np.float64))


def _attitudes(segment: Segment, before: Signal | None) -> Signal:
    """Those of a segment that are new, and the last that is not; (k,) s and (k, 3, 3)."""
    first, last = np.searchsorted(segment.t_attitude, segment.t[[0, -1]])
    if before is not None:
        known = int(np.searchsorted(segment.t_attitude, before[0][-1]))
        first = max(first, known) if known < last else last
    t = segment.t_attitude[first:last]
    if len(t) < 2:  # nothing between them
        return t, segment.R_attitude[first:last]
    stride = max(1, round(STEP_S / float(np.median(np.diff(t)))))
    return t[::stride], segment.R_attitude[first:last][::stride]


def _settled(by: Ekf3, segment: Segment, R: Array, count: int) -> Misled:
    """An EKF that nothing has misled yet, its nose where attitude R (3, 3) has it."""
    nose = rotation_from_euler(0.0, 0.0, np.arctan2(R[1, 0], R[0, 0]))
    return Misled.nothing_yet(by.headed(by.at_rest(segment.R_bs), nose), count)


def _joined(before: Signal | None, new: Signal, start: float) -> Signal:
    """A signal from ``start`` on, s: what was known of it, and what has come."""
    if before is None:
        return new
    kept = slice(max(0, int(np.searchsorted(before[0], start)) - 1), None)
    t, x = before[0][kept], before[1][kept]
    fresh = new[0] > t[-1] if len(t) else np.ones(len(new[0]), dtype=bool)
    return np.concatenate([t, new[0][fresh]]), np.concatenate([x, new[1][fresh]])
