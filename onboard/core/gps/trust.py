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
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Final

from onboard.core.gps.distrust import (
    Distrust,
    RefusedFixes,
    WindowClosed,
    WindowEvent,
    WindowOpened,
)
from onboard.core.gps.held import HeldReasons
from onboard.core.gps.ledger import FixLedger
from onboard.core.gps.limits import LATE_IN_A_ROW, LATE_SHARE, STUCK_SHARE, TrustLimits
from onboard.core.gps.plausibility import Contradiction, FixPlausibility
from onboard.core.gps.receiver_choice import ReceiverChoice
from onboard.core.inputs.boot_time import began_anew
from onboard.core.inputs.samples import (
    AttitudeSample,
    EkfHealth,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    Sample,
)

# EKF_STATUS_FLAGS of MAVLink, and ArduPilot's own bit 15.
EKF_ATTITUDE: Final = 1 << 0
EKF_CONST_POS_MODE: Final = 1 << 7
EKF_UNINITIALIZED: Final = 1 << 10
EKF_GPS_GLITCHING: Final = 1 << 15


class Phase(Enum):
    """Where the window stands.  ``ENDED`` is for good."""

    WAITING = "waiting"
    OPEN = "open"
    SUSPENDED = "suspended"
    ENDED = "ended"


class TrustWindow:
    """Fed with every sample in order of arrival; says whether the latest fix may be used.

    It watches one receiver (:class:`~onboard.core.gps.receiver_choice.ReceiverChoice`).  A fix
    belongs to the window if ``is_open`` after it was fed, and it was neither a repeat nor late.
    """

    def __init__(
        self,
        limits: TrustLimits | None = None,
        *,
        receiver: int | None = None,
        felt: Callable[[float], float] | None = None,
    ) -> None:
        """Take the limits, and the receiver to watch (None: the first that is heard from).

        Args:
            limits: what a trustworthy fix has.
            receiver: its number.
            felt: the largest specific force since a time, s, m/s^2; None: nobody knows.
        """
        self._limits = limits = limits or TrustLimits()
        self._watched = ReceiverChoice(receiver, limits.fix_type)
        self._phase = Phase.WAITING
        self._reason: Distrust | None = None
        self._held = HeldReasons(limits)
        self._ledger = FixLedger()
        self._plausibility = FixPlausibility(limits.plausibility, felt)
        self._last_fix: float | None = None
        self._last_heard = -math.inf  # any message of the receiver, repeats too
        self._now = -math.inf
        self._felt_at = -math.inf  # of the inertial samples, which no fix of their time precedes
        self._late_s = 0.0  # by which the latest fix was behind them when it came
        self._first_opened: float | None = None
        self._late = 0
        self._repeats = False

    @property
    def phase(self) -> Phase:
        """Where the window stands."""
        return self._phase

    @property
    def is_open(self) -> bool:
        """Whether the latest fix may be used."""
        return self._phase is Phase.OPEN

    @property
    def repeats(self) -> bool:
        """Whether the latest fix says again what a moving receiver has said: it is no fix."""
        return self._repeats

    @property
    def reason(self) -> Distrust | None:
        """Why the window is not open; None while it is, and before anything was heard."""
        return None if self.is_open else self._reason

    @property
    def reasons(self) -> tuple[Distrust, ...]:
        """All reasons held now, those that still recover included, the gravest first."""
        return self._held.gravest_first

    @property
    def receiver(self) -> int | None:
        """The receiver watched; None until one was heard from."""
        return self._watched.receiver

    @property
    def trusted_s(self) -> float:
        """Seconds between trusted fixes so far."""
        return self._ledger.trusted_s

    @property
    def rejected(self) -> dict[str, int]:
        """Fixes refused, by the name of the gravest reason at the time."""
        return self._ledger.rejected

    @property
    def refusals(self) -> tuple[RefusedFixes, ...]:
        """When fixes were refused and why, the latest last; of this run."""
        return self._ledger.spans

    def feed(self, sample: Sample) -> tuple[WindowEvent, ...]:
        """Take one sample; most kinds only carry time, if that."""
        if self._phase is Phase.ENDED:
            return ()
        if sample.t is not None and not math.isfinite(sample.t):
            return ()  # a time that is none cannot be put in order: nothing may rest on it
        match sample:
            case ImuSample() | AttitudeSample():
                return self.pass_time(sample.t)
            case GpsFix():
                return self._fix(sample)
            case EkfHealth():
                return self._ekf(sample)
            case GpsIntegrity():
                return self._conditions(
                    sample.t, {Distrust.JAMMED: sample.jammed, Distrust.SPOOFED: sample.spoofed}
                )
            case _:
                return ()

    def restart(self, t: float) -> tuple[WindowEvent, ...]:
        """The autopilot's clock started anew (reboot): forget conditions, keep the counts.

        Args:
            t: the last time on the old clock, s.
        """
        events = self._close(t, Distrust.RESTARTED)
        if self._phase is not Phase.ENDED:
            self._phase, self._reason = Phase.WAITING, Distrust.RESTARTED
        self._forget_fixes()
        self._last_heard, self._now = -math.inf, -math.inf
        self._felt_at = -math.inf
        # A configured duration counts trusted time of one flight; a new boot is a new flight.
        self._first_opened = None
        return events

    def begin_flight(self) -> None:
        """What was learned by the receiver does not count any more: it may have failed since."""
        self._watched.begin_anew()

    def finish(self) -> tuple[WindowEvent, ...]:
        """No more samples will come."""
        return self._end(
            self._last_fix if self._last_fix is not None else 0.0, Distrust.END_OF_DATA
        )

    def pass_time(self, t: float) -> tuple[WindowEvent, ...]:
        """An inertial sample of this time (s, finite) has come.

        Without a fix for too long, the window closes.
        """
        self._felt_at = max(self._felt_at, t)
        return self._pass(t)

    def _pass(self, t: float) -> tuple[WindowEvent, ...]:
        self._now = max(self._now, t)
        if self._phase is not Phase.OPEN or self._last_fix is None:
            return ()
        if t - self._last_fix <= self._limits.gap:
            return ()
        # Repeats of an old fix come on: it is the receiver that stopped, not the link.
        reason = Distrust.GPS_GAP
        if self._last_heard - self._last_fix - self._late_s > STUCK_SHARE * self._limits.gap:
            reason = Distrust.STALE
        elif self._late_s > LATE_SHARE * self._limits.gap:
            reason = Distrust.LATE
        self._held.report(reason, t, bad=True)
        self._plausibility.reset()
        return self._close(self._last_fix, reason)

    def _fix(self, fix: GpsFix) -> tuple[WindowEvent, ...]:
        if self._watched.receiver is None:
            self._watched.receiver = fix.receiver
        if fix.receiver != self._watched.receiver:
            if not self._watched.changes_for(fix):
                return ()
            self._forget_fixes()
        self._repeats = False
        self._now = max(self._now, fix.t)
        self._last_heard = self._now
        last = self._last_fix
        if last is not None and fix.t == last:
            return ()
        if last is not None and fix.t < last:
            return self._late_fix(fix.t, last)
        self._late = 0
        self._late_s = max(0.0, self._felt_at - fix.t)
        has_fix = fix.fix_type >= self._limits.fix_type
        self._repeats = has_fix and self._plausibility.repeats(fix)
        if self._repeats:
            return self._pass(fix.t)
        events: tuple[WindowEvent, ...] = ()
        if last is not None and fix.t - last > self._limits.gap:
            self._held.report(Distrust.GPS_GAP, fix.t, bad=True)
            self._plausibility.reset()
            events = self._close(last, Distrust.GPS_GAP)
        self._last_fix = fix.t
        self._held.report(Distrust.GPS_GAP, fix.t, bad=False)
        if not self.is_open:  # else the next inertial sample says so
            share = LATE_SHARE if Distrust.LATE in self._held.gravest_first else 1.0
            self._held.report(Distrust.LATE, fix.t, bad=self._late_s > share * self._limits.gap)
        for reason, bad in self._judge(fix).items():
            self._held.report(reason, fix.t, bad=bad)
        events += self._settle(fix.t, last)
        if self._limits.duration is not None and self._first_opened is not None:
            end = self._first_opened + self._limits.duration
            if fix.t >= end:
                events += self._end(fix.t, Distrust.CONFIGURED_END)
        return events

    def _late_fix(self, t: float, last: float) -> tuple[WindowEvent, ...]:
        """A fix older than the one before; many in a row say that *that* one was far ahead.

        Only those that are later than a link can make them: one that repeats and reorders brings
        any number of fixes after a newer one.  And not where the one before has just come in time:
        they are a line's that has held them back.
        """
        self._ledger.count(Distrust.STALE)
        if not began_anew(t, last):
            return ()
        self._late += 1
        in_time = 0.0 <= self._felt_at - last <= self._limits.gap
        if self._late < LATE_IN_A_ROW or in_time:
            return ()
        events = self._close(last, Distrust.STALE)
        self._plausibility.reset()
        self._last_fix, self._late = None, 0
        return events

    def _forget_fixes(self) -> None:
        """Another boot or another receiver: nothing of the fixes before says anything now."""
        self._held.clear()
        self._plausibility.reset()
        self._last_fix, self._late = None, 0

    def _judge(self, fix: GpsFix) -> dict[Distrust, bool]:
        """Each reason that a fix by itself and its predecessors can give: True is bad."""
        limits = self._limits
        numbers = (fix.latitude, fix.longitude, fix.altitude, fix.v_n, fix.v_e, fix.v_d or 0.0)
        if not all(map(math.isfinite, numbers)) or fix.fix_type < limits.fix_type:
            # Its other numbers are placeholders, and the way from the last good one is unknown.
            self._plausibility.reset()
            return {Distrust.NO_FIX: True}
        self._watched.has_fix()
        contradiction = self._plausibility.check(fix)
        accuracy = fix.speed_accuracy or 0.0  # 0: unknown
        return {
            Distrust.NO_FIX: False,
            Distrust.FEW_SATELLITES: fix.satellites is not None
            and fix.satellites < limits.satellites,
            Distrust.HDOP: fix.hdop is not None and fix.hdop > limits.hdop,
            Distrust.SPEED_ACCURACY: accuracy > limits.speed_accuracy,
            Distrust.GPS_GLITCH: contradiction in (Contradiction.JUMP, Contradiction.DRIFT),
            Distrust.STALE: contradiction is Contradiction.FROZEN,
        }

    def _settle(self, t: float, last: float | None) -> tuple[WindowEvent, ...]:
        """Drop what has recovered by ``t``, then open, go on, or refuse the fix at ``t``."""
        self._held.drop_recovered(t)
        if self._held:
            reason = self.reasons[0]
            self._ledger.refuse(t, reason)
            events = self._close(t, reason)
            self._reason = reason
            return events
        goes_on = self.is_open and last is not None
        self._ledger.accept(t - last if goes_on and last is not None else 0.0)
        if self.is_open:
            return ()
        self._phase, self._reason = Phase.OPEN, None
        self._watched.settle()
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
                Distrust.EKF_UNHEALTHY: unhealthy,
                Distrust.EKF_GPS_GLITCH: bool(health.flags & EKF_GPS_GLITCHING),
            },
        )

    def _conditions(self, t: float, bad: Mapping[Distrust, bool]) -> tuple[WindowEvent, ...]:
        events: tuple[WindowEvent, ...] = ()
        for reason, is_bad in bad.items():
            self._held.report(reason, t, bad=is_bad)
            if is_bad:
                events += self._close(t, reason)
        return events

    def _close(self, t: float, reason: Distrust) -> tuple[WindowEvent, ...]:
        if not self.is_open:
            return ()
        self._phase, self._reason = Phase.SUSPENDED, reason
        return (WindowClosed(t, reason),)

    def _end(self, t: float, reason: Distrust) -> tuple[WindowEvent, ...]:
        events = self._close(t, reason)
        if self._phase is not Phase.ENDED:
            self._phase, self._reason = Phase.ENDED, reason
        return events
