"""When messages are sent on one link: ArduPilot's intervals in whole milliseconds.

An interval below 0.8 of the main loop's period is refused; due messages go out once a loop,
the next due time counts from the last *due* time so that rates hold on average, and a
reboot forgets everything but the stream rates in the parameters.
"""

from __future__ import annotations

STREAMS: dict[str, tuple[str, ...]] = {
    "RAW_SENS": ("RAW_IMU", "SCALED_IMU2", "SCALED_IMU3", "SCALED_PRESSURE"),
    "EXT_STAT": ("SYS_STATUS", "GPS_RAW_INT"),
    "RC_CHAN": ("SERVO_OUTPUT_RAW",),
    "RAW_CTRL": (),
    "POSITION": ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    "EXTRA1": ("ATTITUDE",),
    "EXTRA2": ("VFR_HUD",),
    "EXTRA3": ("WIND", "SYSTEM_TIME", "BATTERY_STATUS", "EKF_STATUS_REPORT", "VIBRATION"),
    "PARAMS": (),
}
STREAM_IDS = {
    1: "RAW_SENS",
    2: "EXT_STAT",
    3: "RC_CHAN",
    4: "RAW_CTRL",
    6: "POSITION",
    10: "EXTRA1",
    11: "EXTRA2",
    12: "EXTRA3",
}
"""MAV_DATA_STREAM numbers."""

LONGEST_MS = 60_000


def interval_ms(interval_us: float) -> int:
    """Whole milliseconds of an interval asked for in microseconds; at least one."""
    return max(1, min(LONGEST_MS, int(interval_us) // 1000))


def too_fast(interval: int, loop_rate_hz: float) -> bool:
    """Whether ArduPilot refuses an interval (ms) on a main loop of this rate.

    It caps the interval at ``period / 0.8``, in integer milliseconds, and refuses what the
    cap would lengthen.
    """
    period_us = int(1e6 / loop_rate_hz)
    if interval * 800 >= period_us:
        return False
    return int(period_us / 800.0) > interval


class Schedule:
    """Intervals and due times of one link."""

    def __init__(self) -> None:
        self._interval: dict[str, int] = {}
        self._due: dict[str, float] = {}
        self.next_due = float("inf")
        """Earliest boot time (ms) at which something is due."""

    def interval(self, name: str) -> int:
        """Interval in force, ms; 0 is never."""
        return self._interval.get(name, 0)

    def set(self, name: str, interval: int, now_ms: float) -> None:
        """Interval in ms; 0 stops the message."""
        if interval <= 0:
            self._interval.pop(name, None)
            self._due.pop(name, None)
        else:
            self._interval[name] = interval
            self._due[name] = now_ms + interval
        self._refresh()

    def due(self, now_ms: float) -> list[str]:
        """Names of the messages to be sent in this loop, in the order they were asked for."""
        names = [name for name, due in self._due.items() if due <= now_ms]
        for name in names:
            following = self._due[name] + self._interval[name]
            self._due[name] = following if following > now_ms else now_ms + self._interval[name]
        if names:
            self._refresh()
        return names

    def _refresh(self) -> None:
        self.next_due = min(self._due.values(), default=float("inf"))
