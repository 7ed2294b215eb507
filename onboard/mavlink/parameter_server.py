"""The parameter protocol's other side: our own component's parameters, sans IO.

It rests on four rules:

1. Every PARAM_VALUE is a broadcast, so one answer serves every ground station: a list that is
   asked for while another is being sent only makes the cycle go round once more from where it
   is, and ten stations that ask cost no more than one.
2. Values go out as REAL32.  Whole numbers are exact in it, and it alone means the same to the
   stations that cast integers and to those that copy their bytes.
3. What is set is answered with the value then in force: the new one, or the old one where the
   write was denied, as ArduPilot does; PARAM_ERROR says why to those that know it.
4. The number of parameters and their order never change while it runs.

Sending is paced: lists, announcements and answers share a telemetry line with the autopilot, and
whoever can send us a request could fill it.  Beyond ``ASKED_HZ`` a read waits for the list's pace,
once for each name, and a write is left: stations repeat what was not answered.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from onboard.errors import RefusedError
from onboard.mavlink import limits
from onboard.mavlink.dialect import COMPONENT, Message, mavlink
from onboard.mavlink.parameter_messages import (
    MAV_PARAM_TYPE_REAL32,
    ParameterErrorCode,
    number_meant,
    to_float32,
)

NAME_LENGTH = 16

Set = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Writable:
    """What a ground station may set.

    ``set`` is called with a value inside the bounds, and raises
    :class:`~onboard.errors.RefusedError` where the value cannot be had now.
    """

    minimum: float
    maximum: float
    set: Set
    whole: bool = True

    def objection(self, value: float) -> str:
        """Why this value is out of the question, empty if it is not."""
        if not math.isfinite(value) or not self.minimum <= value <= self.maximum:
            return f"allowed are {self.minimum:g} to {self.maximum:g}"
        if self.whole and value != round(value):
            return "allowed are whole numbers"
        return ""


class ParameterServer:
    """Participant of the link that answers for our component's parameters.

    Args:
        values: all of them with their first values, in the order of their indices.
        writable: those that may be set; all others are read-only.
        component: our component id; the system id is the autopilot's.
        list_hz: pace of a list, messages/s.
        announce_hz: pace of announced changes, messages/s.
        denied: told the name and the sentence when a ground station's write is denied.

    Raises:
        ValueError: a name that the protocol cannot carry, a value that it cannot, or a writable
            name without a value.
    """

    names = ("PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET")

    def __init__(
        self,
        values: Mapping[str, float],
        *,
        writable: Mapping[str, Writable],
        component: int = COMPONENT,
        list_hz: float = limits.LIST_HZ,
        announce_hz: float = limits.ANNOUNCE_HZ,
        denied: Callable[[str, str], None] | None = None,
    ) -> None:
        for name in values:
            if not name.isascii() or not 0 < len(name) <= NAME_LENGTH:
                raise ValueError(f"{name!r} is no name for a parameter")
        if unknown := writable.keys() - values.keys():
            raise ValueError(f"writable, but not there: {', '.join(sorted(unknown))}")
        self.counters: Counter[str] = Counter()
        self._order = tuple(values)
        self._index = {name: index for index, name in enumerate(self._order)}
        self._values = {name: to_float32(value) for name, value in values.items()}
        self._writable = dict(writable)
        self._component = component
        self._system: int | None = None
        self._denied = denied
        self._list = _Pace(list_hz)
        self._changes = _Pace(announce_hz)
        self._requests = _Pace(limits.ASKED_HZ, burst_s=1.0)
        self._asked: dict[str, None] = {}
        self._reads_turn = False
        self._next = 0
        self._remaining = 0
        self._changed: dict[str, None] = {}

    @property
    def values(self) -> dict[str, float]:
        """What stations are told, as float32."""
        return dict(self._values)

    def update(self, values: Mapping[str, float]) -> None:
        """New values; those that differ are announced, writable ones first.

        Raises:
            KeyError: no such parameter.
            ValueError: a value that a parameter cannot have.
        """
        for name, value in values.items():
            wanted = to_float32(value)
            if self._values[name] != wanted:
                self._values[name] = wanted
                self._changed[name] = None

    # What the link calls

    def start(self, system: int, component: int, now: float) -> None:  # noqa: ARG002 - the participants' signature
        """Our system id is the autopilot's."""
        self._system = system

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take a ground station's request; the answers, a list excepted."""
        if self._system is None or message.target_system not in (0, self._system):
            return ()
        if message.target_component not in (0, self._component):
            return ()
        match message.get_type():
            case "PARAM_REQUEST_LIST":
                return self._asked_list(now)
            case "PARAM_REQUEST_READ":
                return self._asked_read(message, at_once=self._requests.one(now))
            case "PARAM_SET" if self._requests.one(now):
                return self._asked_set(message)
        self.counters["parameter_requests_left"] += 1
        return ()

    def poll(self, now: float) -> Sequence[Message]:
        """What is due of reads that wait, of a list and of changes."""
        due: list[Message] = []
        if self._asked or self._remaining:
            for _ in range(self._list.take(now)):
                if (name := self._next_due()) is None:
                    break
                due.append(self._value(name))
        if self._changed and not self._remaining:
            count = min(len(self._changed), self._changes.take(now))
            due += [self._value(self._most_urgent()) for _ in range(count)]
        return due

    # How

    def _asked_list(self, now: float) -> Sequence[Message]:
        self.counters["parameter_lists"] += 1
        if not self._remaining:
            self._next = 0
            self._list.begin(now)
        self._remaining = len(self._order)
        return ()

    def _asked_read(self, message: Message, *, at_once: bool) -> Sequence[Message]:
        index = int(message.param_index)
        if index >= 0:
            name = self._order[index] if index < len(self._order) else None
        else:
            name = message.param_id if message.param_id in self._index else None
        if not at_once:
            self.counters["parameter_requests_left"] += name is None
            if name is not None:
                self._asked[name] = None
            return ()
        if name is None:
            return self._error(message, ParameterErrorCode.DOES_NOT_EXIST)
        self.counters["parameter_reads"] += 1
        return (self._value(name),)

    def _asked_set(self, message: Message) -> Sequence[Message]:
        name = message.param_id
        if name not in self._index:
            return self._error(message, ParameterErrorCode.DOES_NOT_EXIST)
        writable = self._writable.get(name)
        if writable is None:
            return self._deny(message, ParameterErrorCode.READ_ONLY, "is read-only")
        value = number_meant(float(message.param_value), message.param_type)
        if objection := writable.objection(value):
            return self._deny(message, ParameterErrorCode.VALUE_OUT_OF_RANGE, objection)
        try:
            writable.set(value)
        except RefusedError as error:
            return self._deny(message, ParameterErrorCode.PERMISSION_DENIED, str(error))
        self.counters["parameter_sets"] += 1
        self._values[name] = to_float32(value)
        return (self._value(name),)

    def _deny(self, message: Message, code: ParameterErrorCode, sentence: str) -> Sequence[Message]:
        self.counters["parameter_sets_denied"] += 1
        if self._denied is not None:
            self._denied(message.param_id, sentence)
        return (self._value(message.param_id), *self._error(message, code))

    def _error(self, message: Message, code: ParameterErrorCode) -> Sequence[Message]:
        """PARAM_ERROR, but never to what was meant for every component: others may have it."""
        if message.target_component != self._component:
            return ()
        return (
            mavlink.MAVLink_param_error_message(
                message.get_srcSystem(),
                message.get_srcComponent(),
                message.param_id.encode(),
                getattr(message, "param_index", -1),
                code.value,
            ),
        )

    def _next_due(self) -> str | None:
        """Reads that wait and the list by turns: neither keeps the other from its end."""
        self._reads_turn = not self._reads_turn
        if self._asked and (self._reads_turn or not self._remaining):
            return next(iter(self._asked))
        if not self._remaining:
            return None
        name = self._order[self._next]
        self._next = (self._next + 1) % len(self._order)
        self._remaining -= 1
        return name

    def _most_urgent(self) -> str:
        name = next((n for n in self._changed if n in self._writable), next(iter(self._changed)))
        del self._changed[name]
        return name

    def _value(self, name: str) -> Message:
        # What stations hear of, for whatever reason, need not be announced to them again.
        self._changed.pop(name, None)
        self._asked.pop(name, None)
        return mavlink.MAVLink_param_value_message(
            name.encode(),
            self._values[name],
            MAV_PARAM_TYPE_REAL32,
            len(self._order),
            self._index[name],
        )


class _Pace:
    """How many messages are due: ``rate`` a second, with bursts of ``burst_s`` at most."""

    def __init__(self, rate: float, burst_s: float = limits.BURST_S) -> None:
        self._rate = rate
        self._burst = max(1.0, rate * burst_s)
        self._credit = 0.0
        self._at: float | None = None

    def begin(self, now: float) -> None:
        """Nothing is due yet."""
        self._credit, self._at = 0.0, now

    def take(self, now: float) -> int:
        """What may be sent now."""
        elapsed = now - self._at if self._at is not None else 1.0 / self._rate
        self._accrue(elapsed, now)
        whole = int(self._credit + 1e-9)
        self._credit -= whole
        return whole

    def one(self, now: float) -> bool:
        """Whether one more may be sent now; at first a whole burst of them."""
        self._accrue(now - self._at if self._at is not None else math.inf, now)
        if self._credit < 1.0:
            return False
        self._credit -= 1.0
        return True

    def _accrue(self, elapsed: float, now: float) -> None:
        self._at = now
        self._credit = min(self._burst, self._credit + max(0.0, elapsed) * self._rate)
