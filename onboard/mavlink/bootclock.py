"""The autopilot's boot clock as its messages stamp it: 32-bit wrap, unix stamps, reboots.

How far a stamp may lie behind the newest before it is of another boot is said once, for the link
and for the estimator: :mod:`onboard.core.inputs.boot_time`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.boot_time import FARTHEST_S, LONGEST_DELAY_S, began_anew, far_ahead
from onboard.mavlink import limits
from onboard.mavlink.dialect import MESSAGE_IDS, Message
from onboard.mavlink.lateness import Lateness
from onboard.mavlink.otherclock import OtherClock

STAMPED_MS: Final = ("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3", "ATTITUDE")
"""Messages with a 32-bit ``time_boot_ms`` of the moment of sending."""
STAMPED_US: Final = ("RAW_IMU", "HIGHRES_IMU", "VIBRATION")
"""Messages with a 64-bit ``time_usec`` of the moment of sending.  Not those of GPS receivers: a fix
may be old, so that it must not set the clock."""
STAMPED: Final = ("SYSTEM_TIME", *STAMPED_MS, *STAMPED_US)
"""All messages that tell the boot time."""
_MS = frozenset(MESSAGE_IDS[name] for name in STAMPED_MS)
_US = frozenset(MESSAGE_IDS[name] for name in STAMPED_US)
_SYSTEM_TIME = MESSAGE_IDS["SYSTEM_TIME"]

WRAP_S = 4294967.296
"""``time_boot_ms`` is a 32-bit count of milliseconds: it starts again after 49.7 days."""


def boot_seconds(message: Message) -> float | None:
    """The boot time that a stamped message tells as it stands, s; None for Unix time or nothing."""
    number = message.get_msgId()
    if number in _MS or number == _SYSTEM_TIME:
        return float(message.time_boot_ms) * 1e-3
    if number in _US and message.time_usec < limits.UNIX_FROM_US:
        return float(message.time_usec) * 1e-6
    return None


class BootClock:
    """Turns message stamps into seconds since boot and notices reboots.

    One instance per autopilot, which :meth:`observe` has to be told every stamped message once, in
    the order of arrival; :meth:`seconds_ms` and :meth:`seconds_us` only convert, so that whoever
    wants to know the time may ask the one clock that there is.  A stamp that is far from those
    before it, on either side, moves nothing before the next one agrees with it: one that is late,
    or damaged, or repeated as it stands, is neither a reboot nor a leap of the clock.  A reboot is
    told with its second stamp, and both of damage that chance lets pass must be in a row.  A boot
    after the last stamp that was heard cannot be older than that is ago: stamps of older ones are
    packets that were held back, or somebody else's, as long as the clock itself goes on.

    After a silence a clock that has begun anew may be ahead of all that was heard before.  But both
    clocks go at the same rate: one that has gone on for less than ours by more than a link can
    delay, and stays so for as long as what a link has held back takes to come, has begun anew.  One
    that catches up meanwhile is what is held back: it comes faster than it was stamped.
    """

    def __init__(self) -> None:
        self.latest: float | None = None
        self.reboots = 0
        self.unseen = False
        """Whether the last reboot was in a silence: its stamps have not gone back."""
        self.other = OtherClock()
        self.lateness = Lateness()
        self._suspect: float | None = None
        self._heard: tuple[float, float] | None = None
        self._silence: tuple[float, float, float, float] | None = None
        self._unix_offset: float | None = None
        self._paired = False
        self._now: float | None = None

    def begin_anew(self) -> None:
        """It is another autopilot from here on."""
        self.latest = self._suspect = self._unix_offset = None
        self._heard = self._silence = None
        self.other.forget()
        self.lateness.forget()
        self._paired = False

    def certain(self, now: float) -> bool:
        """Whether it is known if the autopilot has rebooted; not after a silence for some seconds.

        Args:
            now: our own clock, s, as :meth:`observe` was told it.
        """
        if self._heard is None or self._silence is not None:
            return False
        return now - self._heard[1] <= LONGEST_DELAY_S

    def doubts(self, t: float) -> bool:
        """Whether a stamp, s, is of no boot that was told: far from the newest, on either side."""
        latest = self.latest
        return latest is not None and (began_anew(t, latest) or far_ahead(t, latest))

    def observe(self, message: Message, now: float | None = None) -> bool:
        """Take note of the time that a message tells; whether that confirms a reboot.

        Messages that are not stamped (see ``STAMPED``) say nothing.

        Args:
            message: of the autopilot.
            now: our own monotonic clock, s, where there is one: a recording has none.
        """
        number, before, self._now = message.get_msgId(), self.reboots, now
        stamp = None if now is None else self._stamp(message)
        if stamp is not None and now is not None and self._is_of_another(stamp, now):
            return False
        if number in _MS:
            self._tick(self.seconds_ms(message.time_boot_ms))
        elif number in _US:
            self._tick_us(message.time_usec)
        elif number == _SYSTEM_TIME:
            self._pair(message.time_unix_usec, message.time_boot_ms)
        if self.reboots != before:
            if self._heard is not None:
                self.other.begin(*self._heard)
            self._heard = self._silence = None
        # Unix time runs on through a reboot, and is no boot time before both are known at once.
        doubtful = self._suspect is not None
        if now is not None and self.latest is not None and stamp is not None and not doubtful:
            self._keep_pace(self.latest, now)
            self.lateness.take(self.latest, now)
        return self.reboots != before

    def _stamp(self, message: Message) -> float | None:
        """The boot time that a message tells, s; 32 bits go on across their wrap."""
        if message.get_msgId() in _US:
            return boot_seconds(message)
        told = boot_seconds(message)
        return None if told is None else self.seconds_ms(message.time_boot_ms)

    def _is_of_another(self, stamp: float, now: float) -> bool:
        """Whether a stamp is not this clock's, but that of another one that goes on beside it."""
        if self._heard is None:
            return False
        t, at = self._heard
        if abs(stamp - (t + now - at)) <= LONGEST_DELAY_S:
            return False
        goes_on = now - at <= limits.FAILOVER_S
        if self.other.take(stamp, now, beside=goes_on):
            # One that does not go on was none: what came late was taken for a reboot.
            return goes_on and (self.other.goes_on(now) or stamp > t)
        if began_anew(stamp, t) or far_ahead(stamp, t):
            self.other.begin(stamp, now)
        return False

    def _keep_pace(self, latest: float, now: float) -> None:
        """Whether it has gone on as ours has while nothing was heard, as far as is known by now."""
        if self._heard is not None and self._silence is None:
            t, at = self._heard
            if now - at > LONGEST_DELAY_S:
                self._silence = t, at, now, (now - at) - (latest - t)
        self._heard = latest, now
        if self._silence is None:
            return
        t, at, since, before = self._silence
        behind = (now - at) - (latest - t)
        if behind <= LONGEST_DELAY_S:
            self._silence = None
        elif now - since > LONGEST_DELAY_S:
            if before - behind > limits.CLOCK_AGREES_S:
                self._silence = t, at, now, behind
            else:
                self._begins_anew(latest, unseen=True)

    def _begins_anew(self, t: float, *, unseen: bool = False) -> None:
        self.reboots += 1
        self.unseen = unseen
        self.latest = t
        self._suspect = self._silence = None
        self._unix_offset, self._paired = None, False
        self.lateness.forget()

    def only_advances(self, stamps: NDArray[np.float64]) -> bool:
        """Whether boot times (n,), s, do nothing but go on, in their order of arrival.

        No reboot, no stray stamp that might become one, and no wrap anywhere near: then each is
        converted as it stands, and the time is the largest of those that were heard.
        """
        latest = -np.inf if self.latest is None else self.latest
        newest = np.maximum.accumulate(np.append(latest, stamps))
        step = stamps - newest[:-1]
        odd = (step < -LONGEST_DELAY_S) | ((step > FARTHEST_S) & (newest[:-1] > -np.inf))
        return bool(newest[-1] < WRAP_S - limits.NEAR_WRAP_S and not odd.any())

    def advance(self, t: float) -> None:
        """Stamps of which :meth:`only_advances` holds have come, of which ``t`` is the largest."""
        if self.latest is None or t >= self.latest:
            self.latest = t
            self._suspect = None

    def seconds_ms(self, time_boot_ms: int) -> float:
        """Seconds since boot from a 32-bit ``time_boot_ms``; continues across the wrap."""
        t, latest = time_boot_ms * 1e-3, self._suspect_ahead or self.latest
        if latest is None or latest < WRAP_S - limits.NEAR_WRAP_S:
            return t
        nearest = t + round((latest - t) / WRAP_S) * WRAP_S
        if abs(nearest - latest) < limits.NEAR_WRAP_S:
            return nearest
        same_turn = t + latest // WRAP_S * WRAP_S
        return same_turn if same_turn >= latest else t

    def seconds_us(self, time_usec: int) -> float:
        """Seconds since boot from a 64-bit ``time_usec`` (boot or unix time), however old."""
        t = time_usec * 1e-6
        if time_usec < limits.UNIX_FROM_US:
            return t
        reference = self.latest or 0.0
        if self._unix_offset is None or (
            not self._paired and abs(t - self._unix_offset - reference) > limits.UNIX_STEP_S
        ):
            # Without SYSTEM_TIME the offset is that of the moment: good to the message delay.
            self._unix_offset = t - reference
        return t - self._unix_offset

    def _tick_us(self, time_usec: int) -> None:
        t = self.seconds_us(time_usec)
        if time_usec < limits.UNIX_FROM_US:
            self._tick(t)
        elif self.latest is None or far_ahead(t, self.latest):
            self._go_on(t)
        else:
            # Unix time runs on through a reboot: it tells how late it is, not of reboots.
            self.latest = max(self.latest, t)

    def _pair(self, time_unix_usec: int, time_boot_ms: int) -> None:
        """SYSTEM_TIME: both clocks at one instant."""
        t = self.seconds_ms(time_boot_ms)
        self._tick(t)
        if time_unix_usec > limits.UNIX_FROM_US and self._suspect is None:
            self._unix_offset = time_unix_usec * 1e-6 - t
            self._paired = True

    def _tick(self, t: float) -> None:
        latest, suspect = self.latest, self._suspect
        if latest is None or not began_anew(t, latest):
            self._go_on(t)
        elif (
            suspect is not None
            and 0.0 < abs(t - suspect) < LONGEST_DELAY_S
            and self._may_have_booted(t)
        ):
            self._begins_anew(t)
        else:
            self._suspect = t

    def _may_have_booted(self, t: float) -> bool:
        """Whether a boot of ``t`` s ago fits in the time since the last stamp was heard.

        Where the clock has fallen silent it is not asked how fast another one goes (a simulator's).
        """
        if self._now is None or self._heard is None:
            return True
        silent = self._now - self._heard[1]
        return silent > limits.FAILOVER_S or t <= silent + LONGEST_DELAY_S

    def _go_on(self, t: float) -> None:
        """A stamp that is not of another boot: where it leaps ahead, the next one has to as well.

        That may be further on still: of a simulator in a hurry one comes every minute.
        """
        latest, ahead = self.latest, self._suspect_ahead
        if latest is not None and far_ahead(t, latest):
            agrees = ahead is not None and t != ahead and not began_anew(t, ahead)
            if not agrees:
                self._suspect = t
                return
        self.advance(t)

    @property
    def _suspect_ahead(self) -> float | None:
        """A stamp ahead of all others that waits for the next one, s."""
        latest, suspect = self.latest, self._suspect
        return None if latest is None or suspect is None or suspect < latest else suspect
