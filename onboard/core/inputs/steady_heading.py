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
from typing import Final

import numpy as np

from onboard.core.inputs.reported_attitude import Attitudes, ReportedAttitude
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import (
    rotation_from_euler,
    rotation_from_vector,
    vector_from_rotation,
)

PULLED_RAD_S: Final = 0.1
"""rad/s.  What is slower is the gyroscope's (a bias of 0.01 rad/s, 3 % of a turn of 3 rad/s) or an
EKF's that follows its compass: the filter's own model of the heading has room for it [physics]."""
LOOKED_AT_S: Final = 60.0
"""s from the start of an uninterrupted flight in which the right heading is looked for: twice what
a compass is off for after a take-off [physics]."""
EVERY_S: Final = 0.1
"""s between the moments whose median is taken [cost]."""


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
        at_first = self._sums[-1]
        self._t = np.append(self._t, t[now])
        self._sums = np.append(self._sums, at_first + np.cumsum(by[now]))
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
        if last - self._start > LOOKED_AT_S or len(self._t) == 0:
            return self._right
        at = np.arange(self._start, last, EVERY_S)
        return float(np.median(self._sums[np.searchsorted(self._t, at, side="right")]))


def pulls(segment: Segment) -> tuple[Array, Array]:
    """Attitudes until which the heading has been pulled.

    Returns:
        Their times (j,), s, and by how much since the attitude before (j,), rad.
    """
    t, R = segment.t_attitude, segment.R_attitude[:]
    if len(t) < 2 or len(segment.t) < 2:
        return np.zeros(0), np.zeros(0)
    step = np.diff(segment.t)[:, None]
    angle = np.cumsum(0.5 * step * (segment.w_b[1:] + segment.w_b[:-1]), axis=0)
    angle = np.vstack([np.zeros(3), angle])
    reached = np.stack([np.interp(t, segment.t, angle[:, k]) for k in range(3)], axis=1)
    expected = R[:-1] @ rotation_from_vector(np.diff(reached, axis=0))
    missed = vector_from_rotation(R[1:] @ np.swapaxes(expected, -1, -2))[:, 2]
    known = (t[:-1] >= segment.t[0]) & (t[1:] <= segment.t[-1])
    pulled = known & (np.abs(missed) > PULLED_RAD_S * np.diff(t))
    return t[1:][pulled], missed[pulled]


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
