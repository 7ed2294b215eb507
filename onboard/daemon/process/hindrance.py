"""What keeps the service from learning or writing though the autopilot is heard, in words.

A line that leads one way only, an autopilot that wants signed packets, messages that come too
seldom: nothing fails then, and nothing happens either.  Each is said once it has lasted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from onboard.core.inputs.limits import SLOWEST_IMU_HZ
from onboard.daemon.process import limits
from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.daemon.view.traffic import Traffic
from onboard.mavlink.autopilot import AutopilotState
from onboard.mavlink.link import Link
from onboard.mavlink.streams import Streams

INERTIAL: Final = ("RAW_IMU", "HIGHRES_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")
REFERENCES: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"attitude": ("ATTITUDE", "ATTITUDE_QUATERNION"), "GPS": ("GPS_RAW_INT", "GPS2_RAW")}
)
"""What is needed beside them, however seldom it comes, and the messages that bring it."""


class Hindrance:
    """Looks at what comes back; ``now`` is a monotonic clock, s.

    Args:
        link: what is heard.
        parameters: what is asked.
        streams: what the autopilot was told to send, and has said to that.
        traffic: what comes, and how often.
        has_key: whether there is a key, without which nothing is believed.
    """

    def __init__(
        self,
        link: Link,
        parameters: ParameterWatch,
        streams: Streams,
        traffic: Traffic,
        *,
        has_key: bool,
    ) -> None:
        self._link = link
        self._parameters = parameters
        self._streams = streams
        self._traffic = traffic
        self._has_key = has_key
        self._refused, self._refused_at = 0, -limits.HEARD_OF_LATE_S
        self._enough_at: float | None = None
        self._told_at: float | None = None

    def look(self, now: float) -> None:
        """Take note, once a second or so."""
        refused = self._link.unsigned_beats
        if refused != self._refused:
            self._refused, self._refused_at = refused, now
        present = self._link.state is AutopilotState.PRESENT
        if not present or self._enough_at is None or not self._lacking():
            self._enough_at = now
        if not present or self._told_at is None or not self._parameters.untold:
            self._told_at = now

    def unsigned(self, now: float) -> str:
        """Heartbeats come, but none is signed with the key of the configuration."""
        heard = self._link.state is AutopilotState.PRESENT
        if not self._has_key or heard or now - self._refused_at >= limits.HEARD_OF_LATE_S:
            return ""
        return (
            "heartbeats come that are not signed with the key of [link] signing_key_file: "
            "nothing of it is believed"
        )

    def mute(self, now: float) -> str:
        """The autopilot is heard, and answers nothing."""
        heard = self._link.state is AutopilotState.PRESENT
        waited = self._parameters.unanswered(now)
        if not heard or waited <= limits.UNANSWERED_S:
            return ""
        if self._link.signed and not self._has_key:
            return (
                "the autopilot signs its packets, and answers nothing that is not signed: "
                "[link] signing_key_file"
            )
        if now - self._streams.obeyed_at < waited:
            return (
                "the autopilot obeys, but parameters are asked for in vain: the line has no room "
                "for them beside the samples; a faster one, or lower rates ([link.rates])"
            )
        return "the autopilot is heard, but answers nothing: see whether the line leads to it, too"

    def untold(self, now: float) -> str:
        """Parameters that every autopilot has, which this one does not tell."""
        names = self._parameters.untold
        if not names or self._told_at is None or now - self._told_at <= limits.SELDOM_S:
            return ""
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        return f"the autopilot does not tell {names[0]}{more}: nothing is written without"

    def seldom(self, now: float) -> str:
        """What comes too seldom for anything to be learned, inertial samples before all else."""
        if self._enough_at is None or now - self._enough_at <= limits.SELDOM_S:
            return ""
        return self._lacking()

    def _lacking(self) -> str:
        rate = self._rate(INERTIAL)
        if not rate:
            return f"no inertial samples come ({INERTIAL[0]}): nothing is learned without"
        if rate < SLOWEST_IMU_HZ:
            least = f"nothing is learned from fewer than {SLOWEST_IMU_HZ:g}"
            return f"inertial samples come {rate:g} times a second: {least}, 25 are good"
        for what, names in REFERENCES.items():
            if not self._rate(names):
                return f"no {what} comes ({names[0]}): nothing is learned without"
        return ""

    def _rate(self, names: Sequence[str]) -> float:
        return max(map(self._traffic.rate, names))
