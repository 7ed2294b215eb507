"""The recorded heading without what the autopilot set anew, or pulled over, against its gyroscope.

A vehicle takes off with a compass that iron on the ground, or its motors, turn by as much as a
radian.  The autopilot sets its heading anew in the half minute after, or pulls it over by half a
radian a second, and often back again.  A gyroscope knows better than that how far a vehicle has
turned: what the heading has turned by and the gyroscope has not is taken out.  Which of the
headings before and after is the right one nobody says; it is the one that was held for longest.

Motors whose current pulls the compass may do so in an instant, too.  So what the throttle changed
by in those instants is taken out of it as well
(:data:`~onboard.core.inputs.segments.STEADY_THROTTLE`): what is left of the one turns by what is
left of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.inputs.limits import (
    ATTITUDE_LATE_S,
    GYRO_SHARE,
    HEADING_EVERY_S,
    HEADING_LOOKED_AT_S,
    PULLED_RAD_S,
    STAMPED_S,
)
from onboard.core.inputs.reported_attitude import Attitudes, ReportedAttitude
from onboard.core.inputs.segments import STEADY_THROTTLE, Batch, Segment
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.frames import (
    rotation_from_euler,
    rotation_from_vector,
    vector_from_rotation,
)

SIGMAS = np.arange(-20, 21) / 10.0
"""Of a delay, that are asked: to two of what is expected [probability], and so near to each other
that what lies between two of them is 10 ms off at the most [cost]."""
DELAYS_S = ATTITUDE_LATE_S * SIGMAS
"""By which an attitude may be late, s."""
UNLIKELY = np.where(SIGMAS == 0.0, 0.0, 0.5 * SIGMAS**2 + np.log(len(SIGMAS)))
"""Their surprise, nats: that one of them is there is as likely as that none is [probability]."""


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
        self._missed = UNLIKELY.copy()
        """What is missed with each delay of the attitude, steps."""
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
        steps = self._steps(batch.segment)
        t = steps.t[1:][steps.pulled]
        sampled, changes = _throttle_by(batch.segment, steps)
        by = np.column_stack([steps.missed[steps.pulled], changes])
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

    def _steps(self, segment: Segment) -> Steps:
        """Those of a segment that comes next.

        A late attitude turns when the gyroscope no longer does.  By how much it is late its tilt
        tells, in those parts of the flight in which the heading seems to be pulled.
        """
        turns = Turns(segment)
        steps = turns.steps(0.0)
        if not steps.pulled.any():
            return steps
        self._missed += turns.missed_tilt()
        return turns.steps(DELAYS_S[np.argmin(self._missed)])

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


def _throttle_by(segment: Segment, steps: Steps) -> tuple[Array, Array]:
    """What the throttle changed by while the heading was pulled.

    When between two of its samples it did, its samples do not say.  If it turns the heading, it
    changed as what the gyroscope did not turn by: each pull has its share of the change from one
    sample to the next, be it all or a part that was quick enough to be seen as a pull.

    Args:
        segment: samples.
        steps: those of its heading, of which k pulled.

    Returns:
        (k,) times of samples from which on each of these changes is in them, s, and (k,) the
        changes.
    """
    at, pulled = _times(segment), steps.pulled
    ends = steps.t[1:][pulled]
    if len(ends) == 0 or len(at) < 2:
        return ends, np.zeros(len(ends))
    missed = np.stack([steps.missed, np.where(steps.pulled, steps.missed, 0.0)])
    so_far = np.hstack([np.zeros((2, 1)), np.cumsum(missed, axis=1)])
    turned, by_pulls = np.diff([np.interp(at, steps.t, each) for each in so_far], axis=1)
    # No pull has more than all of a change, and none what goes against the rest of the turn.
    whole = np.where(np.abs(by_pulls) > np.abs(turned), by_pulls, turned)
    change = np.diff(segment.slow["throttle"][1])
    per_rad = np.divide(change, whole, out=np.zeros_like(change), where=by_pulls * turned > 0.0)
    # In the mean over each step, which may go over a sample.
    mean = np.interp(steps.t, at, np.append(0.0, np.cumsum(per_rad * np.diff(at))))
    shares = steps.missed * np.diff(mean) / np.diff(steps.t)
    last = np.minimum(np.searchsorted(at, ends, side="left"), len(at) - 1)
    return at[last], shares[pulled]


@dataclass(frozen=True, slots=True)
class Steps:
    """From one recorded heading to the next.

    Attributes:
        t: (n + 1,) times of the headings, s.
        missed: (n,) what the heading turned by and the gyroscope did not, rad.
        pulled: (n,) where that is more than any gyroscope may be off by.
    """

    t: Array
    missed: Array
    pulled: Mask


class Turns:
    """What heading and gyroscope of a segment turn by from one recorded heading to the next."""

    def __init__(self, segment: Segment) -> None:
        self._t, self._of = segment.t_attitude, segment.t
        self._R = segment.R_attitude[:]
        h, w = np.diff(segment.t), segment.w_b
        size = np.linalg.norm(w, axis=1)
        change = np.linalg.norm(np.diff(w, axis=0), axis=1)
        rates = [0.5 * (w[1:] + w[:-1]), 0.5 * (size[1:] + size[:-1]), 0.25 * change]
        made = np.cumsum(np.column_stack(rates) * h[:, None], axis=0)
        self._sums = np.vstack([np.zeros(5), made]).T
        """(5, n) turn (3) and way until each sample, rad, and by how much the samples may miss it:
        where the rate changes from one to the next, a quarter of a triangle."""

    def steps(self, delay: float) -> Steps:
        """The steps of an attitude that is late by ``delay``, s."""
        if len(self._t) < 2 or len(self._of) < 2:
            return Steps(self._t[:1], np.zeros(0), np.zeros(0, dtype=bool))
        turns = self._over(delay, self._sums)
        expected = self._R[:-1] @ rotation_from_vector(turns[:3].T)
        off = self._R[1:] @ np.swapaxes(expected, -1, -2)
        missed = np.where(self._known(delay), vector_from_rotation(off)[:, 2], 0.0)
        return Steps(self._t, missed, np.abs(missed) > self._allowed(turns))

    def missed_tilt(self) -> Array:
        """How much of the tilt is missed with each of :data:`DELAYS_S`, steps.

        It is late as the heading is, and nothing sets it anew.  Of a step at the most all is
        missed.  To first order in what a step turns by.

        Returns:
            (k,).
        """
        known = self._known(DELAYS_S[0]) & self._known(DELAYS_S[-1])
        turned = vector_from_rotation(self._R[1:] @ np.swapaxes(self._R[:-1], -1, -2))[:, :2].T
        level = 0.5 * (self._R[1:, :2] + self._R[:-1, :2])
        allowed = self._allowed(self._over(0.0, self._sums))
        shares = []
        for delay in DELAYS_S:
            by = np.einsum("ikj,ji->ki", level, self._over(delay, self._sums[:3]))
            missed = np.hypot(*(turned - by)) / allowed
            shares.append(np.minimum(missed, 1.0)[known].sum())
        return np.array(shares)

    def _over(self, delay: float, sums: Array) -> Array:
        """(k, n) what sums (k, m) grow by over each step."""
        over: Array = np.diff([np.interp(self._t - delay, self._of, each) for each in sums], axis=1)
        return over

    def _known(self, delay: float) -> Mask:
        """Steps over which there is a gyroscope."""
        t = self._t - delay
        known: Mask = (t[:-1] >= self._of[0]) & (t[1:] <= self._of[-1])
        return known

    def _allowed(self, turns: Array) -> Array:
        """What a gyroscope may miss of each step, rad."""
        step, (way, missing) = np.diff(self._t), turns[3:]
        allowed: Array = PULLED_RAD_S * step + GYRO_SHARE * way + STAMPED_S * way / step + missing
        return allowed


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
