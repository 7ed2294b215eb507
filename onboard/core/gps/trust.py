"""The trust window: when GPS may be believed, as an explicit state machine.

    WAITING --> OPEN <--> SUSPENDED --> ENDED

It rests on two rules:

1. A *reason* for distrust is held from the report that shows it until its recovery time has
   passed since the report that denies it, so that a value at its limit does not flap.
2. The window is open exactly when a fix has come and no reason is held.  It opens on a fix.

Absence is not distrust: a recording without accuracy, integrity or EKF reports is judged by
what it has.  Time is that of the samples; there is no clock here.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Final, TypeAlias

from onboard.core.gps.plausibility import Contradiction, FixPlausibility, PlausibilityLimits
from onboard.core.inputs.samples import (
    AttitudeSample,
    EkfHealth,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    Sample,
)


class Phase(Enum):
    """Where the window stands.  ``ENDED`` is for good."""

    WAITING = "waiting"
    OPEN = "open"
    SUSPENDED = "suspended"
    ENDED = "ended"


class Reason(StrEnum):
    """Why a window is not open; in the order in which one of several is named."""

    SPOOFED = "spoofed"
    JAMMED = "jammed"
    NO_FIX = "no_fix"
    FEW_SATELLITES = "few_satellites"
    HDOP = "hdop"
    SPEED_ACCURACY = "speed_accuracy"
    GPS_GLITCH = "gps_glitch"
    EKF_GPS_GLITCH = "ekf_gps_glitch"
    EKF_UNHEALTHY = "ekf_unhealthy"
    STALE = "stale"
    GPS_GAP = "gps_gap"
    RESTARTED = "restarted"
    CONFIGURED_END = "configured_end"
    END_OF_DATA = "end_of_data"


_RANK: Final = {reason: rank for rank, reason in enumerate(Reason)}

RECOVERY: Final[Mapping[Reason, float]] = MappingProxyType(
    {
        Reason.SPOOFED: 30.0,  # a spoofer that lets go leaves the receiver's filter wrong for long
        Reason.JAMMED: 10.0,  # loops re-acquire satellite by satellite
        Reason.NO_FIX: 3.0,  # the first fixes after a loss are the worst
        Reason.FEW_SATELLITES: 3.0,
        Reason.HDOP: 3.0,
        Reason.SPEED_ACCURACY: 3.0,
        Reason.GPS_GLITCH: 5.0,  # a receiver's filter settles in some seconds after a slip
        Reason.EKF_GPS_GLITCH: 5.0,
        Reason.EKF_UNHEALTHY: 5.0,  # attitude needs seconds of aiding to become right again
        Reason.STALE: 3.0,
        Reason.GPS_GAP: 0.0,  # a lost packet says nothing about the receiver
        Reason.RESTARTED: 0.0,
    }
)
"""Seconds that a reason is held after the report that denies it."""

# EKF_STATUS_FLAGS of MAVLink, and ArduPilot's own bit 15.
EKF_ATTITUDE: Final = 1 << 0
EKF_CONST_POS_MODE: Final = 1 << 7
EKF_UNINITIALIZED: Final = 1 << 10
EKF_GPS_GLITCHING: Final = 1 << 15

_LATE_IN_A_ROW: Final = 5
MOST_REFUSALS: Final = 512
"""Spans that are remembered: a receiver that flaps for hours must not fill the memory."""
GIVEN_UP_S: Final = 60.0
"""Another receiver's fixes, while there is none of the first: longer than a cold start differs."""


@dataclass(frozen=True, slots=True)
class TrustLimits:
    """What a trustworthy fix has.

    ``fix_type`` at least 3D; ``satellites`` at least; ``hdop`` at most; ``speed_accuracy``
    (m/s) at most; no more than ``gap`` (s) between fixes (1 Hz receivers may miss one);
    ``glitches`` successive fixes outside the filter's gate are a glitch, fewer are outliers;
    ``duration`` (s) from the first opening is the paper's T, None: as long as GPS is there.
    """

    fix_type: int = 3
    satellites: int = 6
    hdop: float = 2.5
    speed_accuracy: float = 1.5
    gap: float = 2.5
    glitches: int = 3
    duration: float | None = None
    plausibility: PlausibilityLimits = field(default_factory=PlausibilityLimits)
    recovery: Mapping[Reason, float] = field(default_factory=lambda: RECOVERY)

    def __deepcopy__(self, memo: object) -> TrustLimits:
        return self  # limits do not change


@dataclass(frozen=True, slots=True)
class WindowOpened:
    """From the fix at ``t`` on GPS is trusted."""

    t: float


@dataclass(frozen=True, slots=True)
class WindowClosed:
    """GPS is no longer trusted; ``t`` (s) is the end of the trusted span."""

    t: float
    reason: Reason


WindowEvent: TypeAlias = WindowOpened | WindowClosed


@dataclass(frozen=True, slots=True)
class Refusal:
    """Fixes in a row that were refused for one reason: the first and the last of them, s."""

    start: float
    end: float
    reason: Reason


class TrustWindow:
    """Fed with every sample in order of arrival; says whether the latest fix may be used.

    It watches one receiver: ``receiver``, or the first that is heard from.  One that has never had
    a trusted fix is given up for another that has had fixes for :data:`GIVEN_UP_S`; one that has,
    is not, for sums hold the latency of one receiver.  A fix belongs to the window if ``is_open``
    after it was fed, and it was neither a repeat nor late.
    """

    def __init__(self, limits: TrustLimits = TrustLimits(), *, receiver: int | None = None) -> None:
        self._limits = limits
        self._receiver = receiver
        self._chosen = receiver is not None
        self._other: tuple[int, float] | None = None  # another with a fix, and since when
        self._phase = Phase.WAITING
        self._reason: Reason | None = None
        self._held: dict[Reason, float] = {}  # reason -> time from which it may be dropped
        self._plausibility = FixPlausibility(limits.plausibility)
        self._last_fix: float | None = None
        self._last_heard = -math.inf  # any message of the receiver, repeats too
        self._now = -math.inf
        self._first_opened: float | None = None
        self._outside = 0
        self._late = 0
        self._trusted_s = 0.0
        self._rejected: dict[Reason, int] = {}
        self._refusals: deque[Refusal] = deque(maxlen=MOST_REFUSALS)
        self._in_a_row = False

    @property
    def phase(self) -> Phase:
        """Where the window stands."""
        return self._phase

    @property
    def is_open(self) -> bool:
        """Whether the latest fix may be used."""
        return self._phase is Phase.OPEN

    @property
    def reason(self) -> Reason | None:
        """Why the window is not open; None while it is, and before anything was heard."""
        return None if self.is_open else self._reason

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """All reasons held now, those that still recover included, the gravest first."""
        return tuple(sorted(self._held, key=_RANK.__getitem__))

    @property
    def receiver(self) -> int | None:
        """The receiver watched; None until one was heard from."""
        return self._receiver

    @property
    def trusted_s(self) -> float:
        """Seconds between trusted fixes so far."""
        return self._trusted_s

    @property
    def rejected(self) -> dict[str, int]:
        """Fixes refused, by the name of the gravest reason at the time."""
        return {
            reason.value: self._rejected[reason] for reason in Reason if reason in self._rejected
        }

    @property
    def refusals(self) -> tuple[Refusal, ...]:
        """When fixes were refused and why, the latest last; of this run."""
        return tuple(self._refusals)

    def restore(self, trusted_s: float, rejected: Mapping[str, int]) -> None:
        """Continue the counts of an earlier run; unknown names are of another version: dropped."""
        self._trusted_s = trusted_s
        names = {reason.value: reason for reason in Reason}
        self._rejected = {names[name]: n for name, n in rejected.items() if name in names}

    def feed(self, sample: Sample) -> tuple[WindowEvent, ...]:
        """Take one sample; most kinds only carry time, if that."""
        if self._phase is Phase.ENDED:
            return ()
        if sample.t is not None and not math.isfinite(sample.t):
            return ()  # a time that is none cannot be put in order: nothing may rest on it
        match sample:
            case ImuSample() | AttitudeSample():
                return self._tick(sample.t)
            case GpsFix():
                return self._fix(sample)
            case EkfHealth():
                return self._ekf(sample)
            case GpsIntegrity():
                return self._conditions(
                    sample.t, {Reason.JAMMED: sample.jammed, Reason.SPOOFED: sample.spoofed}
                )
            case _:
                return ()

    def judge_innovation(self, t: float, ratio: float) -> tuple[WindowEvent, ...]:
        """The filter's verdict on the fix at ``t``: innovation over its gate, > 1 is outside.

        A single fix outside is an outlier: the filter leaves it out, it is counted here as
        ``gps_glitch``, and the window stays open.  ``glitches`` of them in a row close it.
        """
        if not self.is_open:
            return ()
        if ratio <= 1.0:
            self._outside = 0
            return ()
        self._outside += 1
        self._count(Reason.GPS_GLITCH)
        if self._outside < self._limits.glitches:
            return ()
        self._hold(Reason.GPS_GLITCH, t, bad=True)
        return self._close(t, Reason.GPS_GLITCH)

    def restart(self, t: float) -> tuple[WindowEvent, ...]:
        """The autopilot's clock started anew (reboot): forget conditions, keep the counts.

        Args:
            t: the last time on the old clock.
        """
        events = self._close(t, Reason.RESTARTED)
        if self._phase is not Phase.ENDED:
            self._phase, self._reason = Phase.WAITING, Reason.RESTARTED
        self._held.clear()
        self._plausibility.reset()
        self._last_fix, self._last_heard, self._now = None, -math.inf, -math.inf
        # The paper's T counts trusted time of one flight; a new boot is a new flight.
        self._first_opened = None
        self._outside = self._late = 0
        return events

    def finish(self) -> tuple[WindowEvent, ...]:
        """No more samples will come."""
        return self._end(self._last_fix if self._last_fix is not None else 0.0, Reason.END_OF_DATA)

    def _tick(self, t: float) -> tuple[WindowEvent, ...]:
        self._now = max(self._now, t)
        if self._phase is not Phase.OPEN or self._last_fix is None:
            return ()
        if t - self._last_fix <= self._limits.gap:
            return ()
        # Repeats of an old fix come on: it is the receiver that stopped, not the link.
        stuck = self._last_heard - self._last_fix > 0.5 * self._limits.gap
        reason = Reason.STALE if stuck else Reason.GPS_GAP
        self._hold(reason, t, bad=True)
        self._plausibility.reset()
        return self._close(self._last_fix, reason)

    def _fix(self, fix: GpsFix) -> tuple[WindowEvent, ...]:
        events: tuple[WindowEvent, ...]
        if self._receiver is None:
            self._receiver = fix.receiver
        if fix.receiver != self._receiver and not self._gives_up_for(fix):
            return ()
        self._now = max(self._now, fix.t)
        self._last_heard = self._now
        last = self._last_fix
        if last is not None and fix.t == last:
            return ()
        if last is not None and fix.t < last:
            self._count(Reason.STALE)
            self._late += 1
            if self._late < _LATE_IN_A_ROW:
                return ()
            # Not these are late: one stamp of the past was far ahead.  Begin anew from here.
            events = self._close(last, Reason.STALE)
            self._plausibility.reset()
            self._last_fix, self._late = None, 0
            return events
        self._late = 0
        events = ()
        if last is not None and fix.t - last > self._limits.gap:
            self._hold(Reason.GPS_GAP, fix.t, bad=True)
            self._plausibility.reset()
            events = self._close(last, Reason.GPS_GAP)
        self._last_fix = fix.t
        self._hold(Reason.GPS_GAP, fix.t, bad=False)
        for reason, bad in self._judge(fix).items():
            self._hold(reason, fix.t, bad=bad)
        events += self._settle(fix.t, last)
        if self._limits.duration is not None and self._first_opened is not None:
            end = self._first_opened + self._limits.duration
            if fix.t >= end:
                events += self._end(fix.t, Reason.CONFIGURED_END)
        return events

    def _gives_up_for(self, fix: GpsFix) -> bool:
        """Whether this fix of another receiver makes it the one that is watched."""
        if self._chosen or fix.fix_type < self._limits.fix_type:
            return False
        if self._other is None or self._other[0] != fix.receiver:
            self._other = (fix.receiver, fix.t)
        if not fix.t - self._other[1] >= GIVEN_UP_S:
            return False
        self._receiver, self._other = fix.receiver, None
        self._held.clear()
        self._plausibility.reset()
        self._last_fix, self._late = None, 0
        return True

    def _judge(self, fix: GpsFix) -> dict[Reason, bool]:
        """Each reason that a fix by itself and its predecessors can give: True is bad."""
        limits = self._limits
        finite = all(map(math.isfinite, (fix.latitude, fix.longitude, fix.altitude)))
        finite = finite and math.isfinite(fix.v_n) and math.isfinite(fix.v_e)
        finite = finite and (fix.v_d is None or math.isfinite(fix.v_d))
        has_fix = finite and fix.fix_type >= limits.fix_type
        if not has_fix:
            # Its other numbers are placeholders, and the way from the last good one is unknown.
            self._plausibility.reset()
            return {Reason.NO_FIX: True}
        self._other = None
        contradiction = self._plausibility.check(fix)
        accuracy = fix.speed_accuracy or 0.0  # 0: unknown
        return {
            Reason.NO_FIX: False,
            Reason.FEW_SATELLITES: fix.satellites is not None
            and fix.satellites < limits.satellites,
            Reason.HDOP: fix.hdop is not None and fix.hdop > limits.hdop,
            Reason.SPEED_ACCURACY: accuracy > limits.speed_accuracy,
            Reason.GPS_GLITCH: contradiction in (Contradiction.JUMP, Contradiction.DRIFT),
            Reason.STALE: contradiction is Contradiction.FROZEN,
        }

    def _settle(self, t: float, last: float | None) -> tuple[WindowEvent, ...]:
        """Drop what has recovered by ``t``, then open, go on, or refuse the fix at ``t``."""
        self._held = {reason: until for reason, until in self._held.items() if t < until}
        if self._held:
            reason = self.reasons[0]
            self._count(reason)
            self._refuse(t, reason)
            events = self._close(t, reason)
            self._reason = reason
            return events
        self._in_a_row = False
        if self.is_open:
            if last is not None:
                self._trusted_s += t - last
            return ()
        self._phase, self._reason = Phase.OPEN, None
        self._chosen = True
        self._outside = 0
        if self._first_opened is None:
            self._first_opened = t
        return (WindowOpened(t),)

    def _ekf(self, health: EkfHealth) -> tuple[WindowEvent, ...]:
        """What the EKF says of GPS and, as the integral needs it, of its own attitude.

        In constant-position mode it takes the vehicle for standing still: every acceleration
        becomes tilt, and without a compass heading is not aligned yet.  The position and
        velocity flags do not matter here: they speak of its navigation, not of the receiver.
        """
        wrong = EKF_UNINITIALIZED | EKF_CONST_POS_MODE
        unhealthy = bool(health.flags & wrong) or not health.flags & EKF_ATTITUDE
        return self._conditions(
            health.t,
            {
                Reason.EKF_UNHEALTHY: unhealthy,
                Reason.EKF_GPS_GLITCH: bool(health.flags & EKF_GPS_GLITCHING),
            },
        )

    def _conditions(self, t: float, bad: Mapping[Reason, bool]) -> tuple[WindowEvent, ...]:
        events: tuple[WindowEvent, ...] = ()
        for reason, is_bad in bad.items():
            self._hold(reason, t, bad=is_bad)
            if is_bad:
                events += self._close(t, reason)
        return events

    def _hold(self, reason: Reason, t: float, *, bad: bool) -> None:
        if bad:
            self._held[reason] = math.inf
        elif self._held.get(reason) == math.inf:
            self._held[reason] = t + self._limits.recovery.get(reason, 0.0)

    def _close(self, t: float, reason: Reason) -> tuple[WindowEvent, ...]:
        if not self.is_open:
            return ()
        self._phase, self._reason = Phase.SUSPENDED, reason
        return (WindowClosed(t, reason),)

    def _end(self, t: float, reason: Reason) -> tuple[WindowEvent, ...]:
        events = self._close(t, reason)
        if self._phase is not Phase.ENDED:
            self._phase, self._reason = Phase.ENDED, reason
        return events

    def _refuse(self, t: float, reason: Reason) -> None:
        last = self._refusals[-1] if self._refusals else None
        if self._in_a_row and last is not None and last.reason is reason and t >= last.end:
            self._refusals[-1] = replace(last, end=t)
        else:
            self._refusals.append(Refusal(t, t, reason))
        self._in_a_row = True

    def _count(self, reason: Reason) -> None:
        self._rejected[reason] = self._rejected.get(reason, 0) + 1
