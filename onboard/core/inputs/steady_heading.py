"""The recorded heading without what the autopilot set anew, or pulled over, against its gyroscope.

A vehicle takes off with a compass that iron on the ground, or its motors, turn by as much as a
radian.  The autopilot sets its heading anew in the half minute after, or pulls it over by half a
radian a second, and often back again.  A gyroscope knows better than that how far a vehicle has
turned: what the heading has turned by and the gyroscope has not is taken out.  Which of the
headings before and after is the right one nobody says; it is the one that was held for longest.

Motors whose current pulls the compass may do so in an instant, too.  So what the throttle changed
by in those instants is taken out of it as well (:data:`STEADY_THROTTLE`): what is left of the one
turns by what is left of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.inputs.limits import (
    GYRO_SHARE,
    HEADING_EVERY_S,
    HEADING_LOOKED_AT_S,
    PULLED_RAD_S,
    STAMPED_S,
)
from onboard.core.inputs.reported_attitude import Attitudes, ReportedAttitude
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import (
    rotation_from_euler,
    rotation_from_vector,
    vector_from_rotation,
)

STEADY_THROTTLE = "steady_throttle"
"""Name of the slow signal of a throttle that something was taken out of."""


class SteadyHeading:
    """Follows the heading of an uninterrupted flight, batch after batch."""

    def __init__(self) -> None:
        self._begin(0.0)

    def _begin(self, start: float) -> None:
        self._start = start
        self._t = np.zeros(0)
        self._sums = np.zeros((1, 2))
        """What heading, rad, and throttle were pulled by in all: first nothing, then after each of
        the times."""
        self._sampled = np.zeros(0)
        """Until when the throttle changed with each of them: its next sample, s."""
        self._right = np.zeros(2)
        """Sums of the right heading."""

    def joined(self, run: Sequence[Batch], batch: Batch) -> list[Batch]:
        """A flight with one more batch.

        Args:
            run: what went before without interruption and is still at hand, as this has given it.
            batch: as recorded.
        """
        first, last = float(batch.fixes.t[0]), float(batch.fixes.t[-1])
        if batch.fresh:
            self._begin(first)
        t, by = pulls(batch.segment)
        since = self._sampled[-1] if len(self._sampled) else -np.inf
        sampled, changes = _throttle_by(batch.segment, t, since)
        by = np.column_stack([by, changes])
        now, later = (t > first) & (t <= last), t > last
        self._t = np.append(self._t, t[now])
        self._sampled = np.append(self._sampled, sampled[now])
        self._sums = _added(self._sums, by[now])
        before, self._right = self._right, self._right_until(last)
        # Samples reach over the last fix: what happens there is counted with the next batch.
        sums = _added(self._sums, by[later]) - self._right
        at = batch.segment.t_attitude, _times(batch.segment)
        of = np.append(self._t, t[later]), np.append(self._sampled, sampled[later])
        off, throttle = (
            sums[np.searchsorted(pulled, samples, side="right"), k]
            for k, (pulled, samples) in enumerate(zip(of, at, strict=True))
        )
        back = before - self._right
        # Nearly always nothing is: of each batch of hours it need not be asked whenever one comes.
        steady = [_turned(b, back[:1], back[1:]) for b in run] if back.any() else run
        return [*steady, _turned(batch, off, throttle)]

    def _right_until(self, last: float) -> Array:
        """What heading and throttle were pulled by for most of the time."""
        if last - self._start > HEADING_LOOKED_AT_S or len(self._t) == 0:
            return self._right
        at = np.arange(self._start, last, HEADING_EVERY_S)
        held = self._sums[np.searchsorted(self._t, at, side="right")]
        right: Array = held[np.argsort(held[:, 0], kind="stable")[(len(at) - 1) // 2]]
        return right


def _added(sums: Array, by: Array) -> Array:
    """Sums (k + 1, 2) with (j, 2) more behind them."""
    return np.vstack([sums, sums[-1] + np.cumsum(by, axis=0)])


def _times(segment: Segment) -> Array:
    """(j,) times of the throttle's samples, s; none where there is no throttle."""
    return segment.slow["throttle"][0] if "throttle" in segment.slow else np.zeros(0)


def _throttle_by(segment: Segment, t: Array, since: float) -> tuple[Array, Array]:
    """What the throttle changed by while the heading was pulled.

    When between two of its samples it did nobody knows: as quickly, and just then, as the heading.

    Args:
        segment: samples.
        t: (j,) times of attitudes until which the heading has been pulled, s.
        since: what it changed by until then is counted, s.

    Returns:
        (j,) times until which each of the changes goes, s, and (j,) the changes.
    """
    at = _times(segment)
    if len(t) == 0 or len(at) < 2:
        return t, np.zeros(len(t))
    x = segment.slow["throttle"][1]
    begun = segment.t_attitude[np.searchsorted(segment.t_attitude, t) - 1]
    first = np.maximum(np.searchsorted(at, begun, side="right") - 1, 0)
    last = np.minimum(np.searchsorted(at, t, side="left"), len(at) - 1)
    counted = np.searchsorted(at, since, side="right") - 1
    until = np.maximum.accumulate(np.concatenate([[max(counted, 0)], last[:-1]]))
    return at[last], np.where(last > until, x[last] - x[np.maximum(first, until)], 0.0)


def pulls(segment: Segment) -> tuple[Array, Array]:
    """Attitudes until which the heading has been pulled.

    Returns:
        Their times (j,), s, and by how much since the attitude before (j,), rad.
    """
    t = segment.t_attitude
    if len(t) < 2 or len(segment.t) < 2:
        return np.zeros(0), np.zeros(0)
    R, step = segment.R_attitude[:], np.diff(t)
    turns, way, missing = _turns(segment, t)
    expected = R[:-1] @ rotation_from_vector(turns)
    missed = vector_from_rotation(R[1:] @ np.swapaxes(expected, -1, -2))[:, 2]
    allowed = PULLED_RAD_S * step + GYRO_SHARE * way + STAMPED_S * way / step + missing
    known = (t[:-1] >= segment.t[0]) & (t[1:] <= segment.t[-1])
    pulled = known & (np.abs(missed) > allowed)
    return t[1:][pulled], missed[pulled]


def _turns(segment: Segment, t: Array) -> tuple[Array, Array, Array]:
    """What a gyroscope turns by between times ``t`` (k,), s.

    Returns:
        (k - 1, 3) that, rad; (k - 1,) the way there, rad; (k - 1,) by how much its samples may miss
        it, rad: where the rate changes from one to the next, a quarter of a triangle.
    """
    h, w = np.diff(segment.t), segment.w_b
    size = np.linalg.norm(w, axis=1)
    change = np.linalg.norm(np.diff(w, axis=0), axis=1)
    rates = np.column_stack([0.5 * (w[1:] + w[:-1]), 0.5 * (size[1:] + size[:-1]), 0.25 * change])
    sums = np.vstack([np.zeros(5), np.cumsum(rates * h[:, None], axis=0)])
    made = np.diff([np.interp(t, segment.t, sums[:, k]) for k in range(5)], axis=1).T
    return made[:, :3], made[:, 3], made[:, 4]


def _turned(batch: Batch, off: Array, throttle: Array) -> Batch:
    """The same with less heading and throttle.

    Args:
        batch: as it is.
        off: rad, (k,) of each attitude, or (1,) of all.
        throttle: (j,) of each of its samples, or (1,) of all.
    """
    segment = batch.segment
    if off.any():
        recorded = segment.R_attitude
        if isinstance(recorded, ReportedAttitude):
            steady: Attitudes = replace(recorded, angles=recorded.angles - np.outer(off, (0, 0, 1)))
        else:
            steady = rotation_from_euler(0.0, 0.0, -off) @ recorded
        segment = replace(segment, R_attitude=steady)
    if throttle.any() and "throttle" in segment.slow:
        t, x = segment.slow.get(STEADY_THROTTLE, segment.slow["throttle"])
        segment = segment.with_slow(segment.slow | {STEADY_THROTTLE: (t, x - throttle)})
    return batch if segment is batch.segment else replace(batch, segment=segment)
