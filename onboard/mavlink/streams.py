"""Negotiation of message rates with the autopilot; sans-IO.

MAV_CMD_SET_MESSAGE_INTERVAL is asked for one message at a time, because its COMMAND_ACK does
not say which message it is about.  ArduPilot denies an interval that is too short for its
loop rate and an unknown message in the same words, hence the probe with a slow interval
after a first denial, and then bisection for the fastest interval that is granted.  An
answer is a promise only: rates are measured, and asked for again when they do not come.
A line that is full has no room for parameters: while they are written to a vehicle that stands,
less is asked for.  And it says oftener then whether it is armed: HEARTBEATs come once a second by
themselves, and for so long a new value could be set after arming.
Where the parameters say that ATTITUDE is not always of the body, ATTITUDE_QUATERNION is asked for,
too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from onboard.core.inputs.views import Views
from onboard.mavlink import limits
from onboard.mavlink.dialect import COMPONENT, MESSAGE_IDS, Message, mavlink
from onboard.mavlink.one_stream import Stream, StreamRequest, StreamState
from onboard.mavlink.parameter_messages import number_meant

__all__ = ["DEFAULT_STREAMS", "StreamRequest", "StreamState", "StreamStatus", "Streams"]

BODY_ATTITUDE = "ATTITUDE_QUATERNION"
CARRIERS: Final[Mapping[str, str]] = MappingProxyType(
    {"INS_ACC2_ID": "SCALED_IMU2", "INS_ACC3_ID": "SCALED_IMU3"}
)
"""Parameters that are zero where an accelerometer is not there, and the message that would carry
it: ArduPilot sends that for the sake of a compass, a sixth of what an ordinary line carries."""

LEGACY_GROUPS: dict[str, int] = {
    "RAW_IMU": 1,
    "SCALED_IMU": 1,
    "SCALED_IMU2": 1,
    "SCALED_IMU3": 1,
    "GPS_RAW_INT": 2,
    "GPS2_RAW": 2,
    "SYS_STATUS": 2,
    "ATTITUDE": 10,
    "VFR_HUD": 11,
    "VIBRATION": 12,
    "EKF_STATUS_REPORT": 12,
    "BATTERY_STATUS": 12,
    "SYSTEM_TIME": 12,
    "WIND": 12,
}
"""MAV_DATA_STREAM that carries each message on firmware which has only REQUEST_DATA_STREAM."""


@dataclass(frozen=True, slots=True)
class StreamStatus:
    """One line of the status page; rates in Hz, None where not known."""

    name: str
    state: StreamState
    asked: float
    granted: float | None
    measured: float | None


DEFAULT_STREAMS = (
    StreamRequest("RAW_IMU", 50.0),
    StreamRequest("HIGHRES_IMU", 50.0),
    StreamRequest("SCALED_IMU2", 50.0),
    StreamRequest("SCALED_IMU3", 50.0),
    StreamRequest("ATTITUDE", 50.0),
    StreamRequest("GPS_RAW_INT", 10.0),
    StreamRequest("GPS2_RAW", 10.0),
    StreamRequest("VIBRATION", 2.0),
    StreamRequest("EKF_STATUS_REPORT", 2.0),
    StreamRequest("EXTENDED_SYS_STATE", 2.0),
    StreamRequest("VFR_HUD", 5.0),
    StreamRequest("WIND", 1.0),
    StreamRequest("BATTERY_STATUS", 1.0),
    StreamRequest("SYSTEM_TIME", 1.0),
)


class Streams:
    """Gets the requested messages flowing and keeps them so; a link participant.

    Args:
        requests: what is wanted.

    Raises:
        ValueError: a message that the dialect does not have.
    """

    def __init__(self, requests: Iterable[StreamRequest] = DEFAULT_STREAMS) -> None:
        try:
            self._streams = {stream.number: stream for stream in map(Stream, requests)}
        except KeyError as error:
            raise ValueError(f"no MAVLink message is called {error.args[0]}") from None
        reported = self._streams.get(MESSAGE_IDS["ATTITUDE"])
        self._body_rate = 0.0 if reported is None else reported.request.rate
        self._views = Views()
        self.legacy = False
        self.obeyed_at = -math.inf
        """When it last said yes or no to a question, s: it hears us, and is heard."""
        self.writing: Callable[[], bool] = lambda: False
        """Whether parameters are being written to a vehicle that stands."""
        self._often, self._beats_to_ask, self._ask_beats_at = False, 0, 0.0
        self._fewer: list[Stream] = []
        self._owed: dict[int, int] = {}
        self._target: tuple[int, int] | None = None
        self._current: Stream | None = None
        self._rung = 0
        self._asked_at = 0.0
        self._asks = 0
        self._answered = self._takes_back = False
        self._mute = 0
        self._too_fast = 0
        self._quiet_until = 0.0
        self._groups_asked: dict[int, float] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The messages to be fed: answers, parameters, and all that are or may be measured."""
        measured = (stream.request.name for stream in self._streams.values())
        return tuple(dict.fromkeys(("COMMAND_ACK", "PARAM_VALUE", *measured, BODY_ATTITUDE)))

    @property
    def owes(self) -> bool:
        """Whether what was made to come seldom has not been granted as before since."""
        return not self._streams.keys().isdisjoint(self._owed)

    def parting(self) -> Sequence[Message]:
        """That again, all at once: for who has no time to wait for answers."""
        beats = [mavlink.MAVLINK_MSG_ID_HEARTBEAT] if self._often or self._beats_to_ask else []
        return [self._command(number, 0.0) for number in beats] + [
            self._command(number, 1e3 * interval_ms)
            for number, interval_ms in self._owed.items()
            if number in self._streams
        ]

    def start(self, system: int, component: int, now: float) -> None:
        """Begin with this autopilot; again after a reboot, for intervals do not outlive one."""
        if self._target != (system, component):
            self._owed.clear()
            self._views.forget()
            self._follow_views(now)
            for stream in self._streams.values():
                stream.unwanted = False
        self._target = (system, component)
        self.legacy = False
        self._current = None
        self._answered = False
        self._mute = 0
        self._too_fast = 0
        self._quiet_until = now
        self._groups_asked.clear()
        self._fewer.clear()
        for stream in self._streams.values():
            stream.restart(now)

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Count a message or take an answer.

        The next question waits for :meth:`poll`, so that the same acknowledgement come twice
        is not taken for its answer.
        """
        source = (message.get_srcSystem(), message.get_srcComponent())
        if source != self._target:
            return ()
        stream = self._streams.get(message.get_msgId())
        if stream is not None:
            stream.count()
            return ()
        if message.get_msgId() == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
            value = number_meant(float(message.param_value), message.param_type)
            if self._views.take(message.param_id, value):
                self._follow_views(now)
            carrier = self._streams.get(MESSAGE_IDS.get(CARRIERS.get(message.param_id, ""), -1))
            if carrier is not None:
                carrier.want(now, wanted=value != 0.0)
                if carrier.unwanted and self.legacy:  # groups are asked for as a whole
                    carrier.rest()
            return ()
        if (
            message.get_msgId() != mavlink.MAVLINK_MSG_ID_COMMAND_ACK
            or message.command != mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
            or message.target_system not in (0, source[0])
            or message.target_component not in (0, COMPONENT)
            or self._current is None
        ):
            return ()
        self._answer(self._current, message.result, now)
        return ()

    def poll(self, now: float) -> Sequence[Message]:
        """Measure; return the question that is due, if any."""
        if beats := self._beats(now):
            return beats
        if self._fewer:
            if self.writing():
                return ()
            self._as_before(now)
        for stream in self._streams.values():
            stream.measure(now)
        if self._target is None:
            return ()
        if self.writing() and not self.legacy and any(s.is_short for s in self._streams.values()):
            return self._ask_for_fewer()
        if self._current is None:
            return self._next(now) if now >= self._quiet_until else ()
        if now - self._asked_at < limits.ACK_TIMEOUT_S:
            return ()
        if self._asks < limits.ASKS:
            return self._ask(self._current, now)
        self._current.ask_later(now, StreamState.WAITING)
        self._current = None
        if not self._answered:
            self._mute += 1
            if self._mute >= limits.MUTE_MESSAGES:
                self._go_legacy(now)
        return self._next(now)

    def report(self) -> tuple[StreamStatus, ...]:
        """The state of every stream, in the order of the requests."""
        return tuple(
            StreamStatus(
                name=stream.request.name,
                state=stream.state,
                asked=stream.request.rate,
                granted=None if stream.granted_ms is None else 1e3 / stream.granted_ms,
                measured=stream.measured,
            )
            for stream in self._streams.values()
        )

    def _beats(self, now: float) -> Sequence[Message]:
        """Have HEARTBEATs come oftener while parameters are written, and as by itself after it.

        Nobody waits for an answer, and one is not to be taken for another question's.
        """
        often = self.writing()
        if often is not self._often:
            self._often, self._beats_to_ask, self._ask_beats_at = often, limits.BEATS_ASKED, now
        if not self._beats_to_ask or now < self._ask_beats_at or self._target is None:
            return ()
        self._beats_to_ask -= 1
        self._ask_beats_at = now + limits.ACK_TIMEOUT_S
        if self.legacy:
            return ()
        self._current = None
        self._quiet_until = max(self._quiet_until, now + limits.ACK_TIMEOUT_S)
        return [self._command(mavlink.MAVLINK_MSG_ID_HEARTBEAT, 1e3 * limits.BEATS_MS * often)]

    def _ask_for_fewer(self) -> Sequence[Message]:
        """What comes often comes seldom from here on; answers to this have no room either."""
        self._current = None
        self._fewer = [
            stream
            for stream in self._streams.values()
            if stream.granted_ms is not None and stream.granted_ms < limits.SELDOM_MS
        ]
        self._owed |= {s.number: s.granted_ms or s.request.interval_ms for s in self._fewer}
        return [self._command(s.number, 1e3 * limits.SELDOM_MS) for s in self._fewer]

    def _as_before(self, now: float) -> None:
        """Each is asked for again as it was granted."""
        for stream in self._fewer:
            stream.begin_again(now)
        self._fewer.clear()
        self._quiet_until = now + limits.ACK_TIMEOUT_S  # answers to what was asked for last

    def _follow_views(self, now: float) -> None:
        """Ask for the body's attitude where ATTITUDE may be another one."""
        wanted = self._body_rate and self._views.told
        number = MESSAGE_IDS[BODY_ATTITUDE]
        if not wanted:
            dropped = self._streams.pop(number, None)
            if dropped is not None and dropped is self._current:
                self._current = None
        elif number not in self._streams:
            self._streams[number] = Stream(StreamRequest(BODY_ATTITUDE, self._body_rate))
            self._streams[number].restart(now)

    def _answer(self, stream: Stream, result: int, now: float) -> None:
        self.obeyed_at = now
        if result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._asked_at = now
            return
        self._current = None
        self._owed.pop(stream.number, None)
        if self._asks > 1:
            # The earlier tries may be answered yet: let that pass before the next question.
            self._quiet_until = now + limits.ACK_TIMEOUT_S
        if result == mavlink.MAV_RESULT_UNSUPPORTED and not self._answered:
            self._go_legacy(now)
        elif stream.unwanted and (self._takes_back or result != mavlink.MAV_RESULT_ACCEPTED):
            stream.rest()
        elif stream.unwanted:  # what was asked for before that was known is taken back next
            stream.settle(now, self._rung)
            stream.due = now
        elif result == mavlink.MAV_RESULT_ACCEPTED:
            self._answered = True
            stream.settle(now, self._rung)
            self._refine(stream, now)
        elif result == mavlink.MAV_RESULT_DENIED:
            self._answered = True
            if stream.granted is not None and self._rung >= stream.granted:
                stream.granted, stream.denied = None, -1  # granted once, no longer
            stream.denied = max(stream.denied, self._rung)
            self._refine(stream, now)
        else:
            stream.ask_later(now, StreamState.WAITING)

    def _refine(self, stream: Stream, now: float) -> None:
        """After a yes or a no: is there another interval to ask for?"""
        if stream.choose(0) is not None:
            # Before any other stream, which can then profit from the limit found here.
            stream.state, stream.due = StreamState.ASKED, -math.inf
        elif stream.granted is None:
            stream.give_up(now)
        else:
            stream.settle(now, stream.granted)
            if stream.denied >= 0:
                self._too_fast = max(self._too_fast, stream.ladder[stream.denied])

    def _next(self, now: float) -> Sequence[Message]:
        """Ask for the stream that has been due longest."""
        due = [s for s in self._streams.values() if s.due is not None and s.due <= now]
        if not due:
            return ()
        if self.legacy:
            return [message for stream in due for message in self._ask_legacy(stream, now)]
        stream = min(due, key=lambda s: s.due or 0.0)
        rung = stream.choose(self._too_fast)
        self._current, self._asks = stream, 0
        self._rung = rung if rung is not None else stream.granted or 0
        return self._ask(stream, now)

    def _ask(self, stream: Stream, now: float) -> Sequence[Message]:
        if self._target is None:
            return ()
        stream.state = StreamState.ASKED
        self._asked_at = now
        self._takes_back = stream.unwanted  # 0: as often as by itself
        interval_us = 0.0 if self._takes_back else 1e3 * stream.ladder[self._rung]
        message = self._command(stream.number, interval_us, self._asks)
        self._asks += 1
        return (message,)

    def _command(self, number: int, interval_us: float, repetition: int = 0) -> Message:
        return mavlink.MAVLink_command_long_message(
            *(self._target or (0, 0)),
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
            repetition,
            float(number),
            interval_us,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        )

    def _go_legacy(self, now: float) -> None:
        self.legacy = True
        self._current = None
        for stream in self._streams.values():
            stream.restart(now)

    def _ask_legacy(self, stream: Stream, now: float) -> Sequence[Message]:
        """REQUEST_DATA_STREAM for the group that carries the message, at its fastest rate."""
        group = LEGACY_GROUPS.get(stream.request.name)
        if group is None or self._target is None:
            stream.state, stream.due = StreamState.UNSUPPORTED, None
            return ()
        stream.settle(now, 0)
        asked = self._groups_asked.get(group)
        if asked is not None and now - asked < limits.ACK_TIMEOUT_S:
            return ()
        self._groups_asked[group] = now
        rate = max(
            s.request.rate
            for s in self._streams.values()
            if LEGACY_GROUPS.get(s.request.name) == group
        )
        return (
            mavlink.MAVLink_request_data_stream_message(
                *self._target, group, max(1, round(rate)), 1
            ),
        )
