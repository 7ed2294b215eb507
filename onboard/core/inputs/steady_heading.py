"""The recorded heading without what the autopilot set anew, or pulled over, against its gyroscope.

A vehicle takes off with a compass that iron on the ground, or its motors, turn by as much as a
radian.  The autopilot sets its heading anew in the half minute after, or pulls it over by half a
radian a second, and often back again.  A gyroscope knows better than that how far a vehicle has
turned: what the heading has turned by and the gyroscope has not is taken out.  Which of the
headings before and after is the right one nobody says; it is the one that was held for longest.
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


class SteadyHeading:
    """Follows the heading of an uninterrupted flight, batch after batch."""

    def __init__(self) -> None:
        self._start = 0.0
        self._t = np.zeros(0)
        self._sums = np.zeros(1)
        """What the heading was pulled by in all, rad: first nothing, then after each of the times.
        """
        self._right = 0.0
        """That of the right heading."""

    def joined(self, run: Sequence[Batch], batch: Batch) -> list[Batch]:
        """A flight with one more batch.

        Args:
            run: what went before without interruption and is still at hand, as this has given it.
            batch: as recorded.
        """
        first, last = float(batch.fixes.t[0]), float(batch.fixes.t[-1])
        if batch.fresh:
            self._start, self._t, self._sums, self._right = first, np.zeros(0), np.zeros(1), 0.0
        t, by = pulls(batch.segment)
        now, later = (t > first) & (t <= last), t > last
        self._t = np.append(self._t, t[now])
        self._sums = np.append(self._sums, self._sums[-1] + np.cumsum(by[now]))
        before, self._right = self._right, self._right_until(last)
        # Samples reach over the last fix: what happens there is counted with the next batch.
        times = np.append(self._t, t[later])
        sums = np.append(self._sums, self._sums[-1] + np.cumsum(by[later]))
        samples = batch.segment.t_attitude
        off = sums[np.searchsorted(times, samples, side="right")] - self._right
        back = np.full(1, self._right - before)
        return [*(_turned(b, -back) for b in run), _turned(batch, off)]

    def _right_until(self, last: float) -> float:
        """What the heading was pulled by for most of the time."""
        if last - self._start > HEADING_LOOKED_AT_S or len(self._t) == 0:
            return self._right
        at = np.arange(self._start, last, HEADING_EVERY_S)
        return float(np.median(self._sums[np.searchsorted(self._t, at, side="right")]))


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


def _turned(batch: Batch, off: Array) -> Batch:
    """The same with headings smaller by ``off``, rad: (k,) of each attitude, or (1,) of all."""
    if not off.any():
        return batch
    recorded = batch.segment.R_attitude
    if isinstance(recorded, ReportedAttitude):
        steady: Attitudes = replace(recorded, angles=recorded.angles - np.outer(off, (0, 0, 1)))
    else:
        steady = rotation_from_euler(0.0, 0.0, -off) @ recorded
    return replace(batch, segment=replace(batch.segment, R_attitude=steady))
