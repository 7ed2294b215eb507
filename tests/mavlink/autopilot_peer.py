"""ArduPilot's side of MAV_CMD_SET_MESSAGE_INTERVAL, for tests."""

from __future__ import annotations

from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from tests.mavlink.mavlink_peer import received

NAMES = {number: name for name, number in MESSAGE_IDS.items()}


class StreamingAutopilot:
    """Grants intervals as ArduPilot does: whole ms, none faster than the loop allows.

    ``unknown`` messages are denied in the same words as too fast ones.  ``answers=False`` is
    firmware without the command that says nothing; ``unsupported=True`` says so.
    """

    def __init__(
        self, *, fastest_ms=4, unknown=(), silent=(), answers=True, unsupported=False
    ) -> None:
        self.fastest_ms = fastest_ms
        self.unknown = set(unknown)
        self.silent = set(silent)
        self.answers = answers
        self.unsupported = unsupported
        self.intervals: dict[str, float] = {}
        self.groups: dict[int, int] = {}
        self.asked: list[tuple[str, float]] = []
        self.denials = 0
        self._due: dict[str, float] = {}

    def reboot(self) -> None:
        self.intervals.clear()
        self.groups.clear()

    def take(self, message):
        """The COMMAND_ACKs that a message of ours brings, or none."""
        if message.get_type() == "REQUEST_DATA_STREAM":
            self.groups[message.req_stream_id] = message.req_message_rate
            return []
        assert message.get_type() == "COMMAND_LONG"
        assert message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        name, interval_ms = NAMES[round(message.param1)], message.param2 / 1e3
        self.asked.append((name, interval_ms))
        if not self.answers:
            return []
        if self.unsupported:
            return [self._ack(mavlink.MAV_RESULT_UNSUPPORTED)]
        assert interval_ms == int(interval_ms), "ArduPilot cuts to whole ms"
        if interval_ms == 0.0:  # as often as by itself: never
            self.intervals.pop(name, None)
            return [self._ack(mavlink.MAV_RESULT_ACCEPTED)]
        if name in self.unknown or interval_ms < self.fastest_ms:
            self.denials += 1
            return [self._ack(mavlink.MAV_RESULT_DENIED)]
        self.intervals[name] = interval_ms
        return [self._ack(mavlink.MAV_RESULT_ACCEPTED)]

    def _ack(self, result):
        ack = mavlink.MAVLink_command_ack_message(
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, result, 0, 0, 1, 191
        )
        return received(ack)

    def stream(self, now):
        """Names of the messages that are due at ``now`` (s)."""
        out = []
        for name, interval in self.intervals.items():
            due = self._due.get(name, now)
            if name not in self.silent and now >= due - 1e-9:
                out.append(name)
                self._due[name] = max(due + interval * 1e-3, now)
        return out
