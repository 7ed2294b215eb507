"""The autopilot's boot clock as its messages stamp it: 32-bit wrap, unix stamps, reboots."""

from __future__ import annotations

WRAP_S = 4294967.296
"""``time_boot_ms`` is a 32-bit count of milliseconds: it starts again after 49.7 days."""
NEAR_WRAP_S = 600.0
"""A jump back by one wrap counts as a wrap only this close to it; else it is a reboot."""
UNIX_FROM_US = 10**15
"""A ``time_usec`` above this (31 years of uptime) is unix time: some autopilots send that."""
REBOOT_STEP_S = 3.0
"""Time that goes back by less is late delivery (UDP, radio buffers), not a reboot."""
UNIX_STEP_S = 10.0
"""Unix time that departs this far from boot time has been set (by GPS, say)."""


class BootClock:
    """Turns message stamps into seconds since boot and notices reboots.

    One instance per autopilot, fed in the order of arrival.  A reboot is confirmed by the
    second stamp that lies in the past, so that one stray late packet is not taken for it.
    """

    def __init__(self) -> None:
        self.latest: float | None = None
        self.reboots = 0
        self._suspect: float | None = None
        self._unix_offset: float | None = None
        self._paired = False

    def from_ms(self, time_boot_ms: int) -> float:
        """Seconds since boot from a 32-bit ``time_boot_ms``; continues across the wrap."""
        t = self._unwrapped(time_boot_ms * 1e-3)
        self._observe(t)
        return t

    def from_us(self, time_usec: int) -> float:
        """Seconds since boot from a 64-bit ``time_usec`` (boot or unix time)."""
        t = self.convert_us(time_usec)
        if time_usec < UNIX_FROM_US:
            self._observe(t)
        elif self.latest is None or t > self.latest:
            # Unix time runs on through a reboot: it tells how late it is, not of reboots.
            self.latest = t
        return t

    def convert_us(self, time_usec: int) -> float:
        """As :meth:`from_us`, for a stamp that may be old and says nothing about now."""
        t = time_usec * 1e-6
        if time_usec < UNIX_FROM_US:
            return t
        reference = self.latest or 0.0
        if self._unix_offset is None or (
            not self._paired and abs(t - self._unix_offset - reference) > UNIX_STEP_S
        ):
            # Without SYSTEM_TIME the offset is that of the moment: good to the message delay.
            self._unix_offset = t - reference
        return t - self._unix_offset

    def pair(self, time_unix_usec: int, time_boot_ms: int) -> None:
        """SYSTEM_TIME: both clocks at one instant."""
        t = self.from_ms(time_boot_ms)
        if time_unix_usec > UNIX_FROM_US:
            self._unix_offset = time_unix_usec * 1e-6 - t
            self._paired = True

    def _unwrapped(self, t: float) -> float:
        latest = self.latest
        if latest is None or latest < WRAP_S - NEAR_WRAP_S:
            return t
        nearest = t + round((latest - t) / WRAP_S) * WRAP_S
        if abs(nearest - latest) < NEAR_WRAP_S:
            return nearest
        same_turn = t + latest // WRAP_S * WRAP_S
        return same_turn if same_turn >= latest else t

    def _observe(self, t: float) -> None:
        latest = self.latest
        if latest is None or t >= latest:
            self.latest = t
            self._suspect = None
        elif t < latest - REBOOT_STEP_S:
            if self._suspect is not None and abs(t - self._suspect) < REBOOT_STEP_S:
                self.reboots += 1
                self.latest = t
                self._suspect = None
                self._unix_offset, self._paired = None, False
            else:
                self._suspect = t
