"""Sans-IO client of the MAVLink parameter protocol, as ArduPilot speaks it.

Two rules hold everywhere:

1. Only a PARAM_VALUE from the autopilot changes the cache; sending never does.
2. Silence is an answer: an unknown name and a NaN get no reply, so every exchange ends by
   itself after a bounded number of attempts.

A driver owns clock and wire::

    outputs = client.read(names, now) / client.set(name, value, now)
    outputs = client.feed(event, now)      # events of onboard.mavlink.parameter_messages
    outputs = client.tick(now)             # not later than client.next_deadline()

Each output is an action to send (:data:`SendAction`) or a result (:data:`ParameterResult`);
both are frozen, and in the order in which they are to be acted on.

How a set is acknowledged: PARAM_SET; then a PARAM_VALUE equal to the float32 that was sent,
seen before anything was read back (ArduPilot's broadcast, made once the value is stored);
then a PARAM_REQUEST_READ that agrees.  A PARAM_VALUE that differs is not yet a refusal: it
can be a late duplicate, or the broadcast of the whole vector that follows a write to its x
element.  It is read back, and the read decides.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType
from typing import TypeAlias

from onboard.mavlink import limits
from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    ParameterErrorCode,
    ParameterEvent,
    SendAction,
    SendParamRead,
    SendParamSet,
    TextReceived,
    ValueReceived,
    to_float32,
)

DENIAL = "Param write denied"


class Failure(Enum):
    """Why an exchange failed."""

    SILENT = "silent"
    DOES_NOT_EXIST = "does_not_exist"
    DENIED = "denied"
    NOT_TAKEN = "not_taken"
    CHANGED_BY_OTHER = "changed_by_other"


@dataclass(frozen=True, slots=True)
class ValueRead:
    """A read that we asked for succeeded."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ReadFailed:
    """A read that we asked for got no value: no such name, or the link is down."""

    name: str
    failure: Failure


@dataclass(frozen=True, slots=True)
class SetDone:
    """Written and read back; ``saved`` is False where the autopilot never said so."""

    name: str
    value: float
    saved: bool


@dataclass(frozen=True, slots=True)
class SetFailed:
    """Not written; ``value`` is what the autopilot last reported, None if it never did."""

    name: str
    failure: Failure
    value: float | None


@dataclass(frozen=True, slots=True)
class ValueChanged:
    """A value that nobody here asked for differs from the cache (or is new to it)."""

    name: str
    previous: float | None
    value: float


ParameterResult: TypeAlias = ValueRead | ReadFailed | SetDone | SetFailed | ValueChanged
ParameterOutput: TypeAlias = SendAction | ParameterResult


@dataclass(frozen=True, slots=True, kw_only=True)
class ClientSettings:
    """Patience of the client: reads at a time, tries of each, and how long each try waits (s).

    ``pause_s``: the least time between two writes of one parameter.
    """

    in_flight: int = limits.READS_IN_FLIGHT
    attempts: int = limits.ATTEMPTS
    first_timeout_s: float = limits.FIRST_TIMEOUT_S
    timeout_growth: float = limits.TIMEOUT_GROWTH
    longest_timeout_s: float = limits.LONGEST_TIMEOUT_S
    pause_s: float = limits.REPEAT_PAUSE_S

    def timeout(self, attempt: int) -> float:
        """Seconds to wait after attempt 1, 2, ..."""
        grown = self.first_timeout_s * self.timeout_growth ** (attempt - 1)
        return min(self.longest_timeout_s, grown)


class _Phase(Enum):
    READING = auto()
    CHECKING = auto()
    SETTING = auto()
    CONFIRMING = auto()


@dataclass(slots=True)
class _Exchange:
    name: str
    phase: _Phase
    attempts: int
    wanted: float | None = None
    before: float | None = None
    tries: int = 0
    sets: int = 0
    set_at: float = 0.0
    saved: bool = False
    denied: bool = False
    overtaken: bool = False
    seen: float | None = None
    deadline: float | None = None


class ParameterClient:
    """Reads and sets parameters of one autopilot; see the module for the rules.

    One exchange per name: reading a name that is already being read or set adds nothing (the
    answer of the one under way serves both), setting a name supersedes what is under way.
    """

    def __init__(self, settings: ClientSettings | None = None) -> None:
        self._settings = settings or ClientSettings()
        self._cache: dict[str, float] = {}
        self._exchanges: OrderedDict[str, _Exchange] = OrderedDict()
        self._out: list[ParameterOutput] = []

    @property
    def cache(self) -> Mapping[str, float]:
        """Values by name as the autopilot last reported them (read-only view)."""
        return MappingProxyType(self._cache)

    @property
    def busy(self) -> bool:
        """Whether an exchange is under way or queued."""
        return bool(self._exchanges)

    def read(
        self, names: Iterable[str], now: float, attempts: int | None = None
    ) -> tuple[ParameterOutput, ...]:
        """Ask for parameters; each ends as ValueRead or ReadFailed.

        ``attempts`` fewer than the settings' suits names that may well not exist: those cost
        the full time-out, as there is no reply to them.
        """
        for name in names:
            if name not in self._exchanges:
                self._exchanges[name] = _Exchange(
                    name, _Phase.READING, attempts or self._settings.attempts
                )
        return self._flush(now)

    def set(
        self, name: str, value: float, now: float, before: float | None = None
    ) -> tuple[ParameterOutput, ...]:
        """Write one parameter; ends as SetDone or SetFailed.

        Args:
            name: the parameter.
            value: rounded to float32 here.
            now: the driver's monotonic clock, s.
            before: the value in force as last read.  With it the write is as near to a
                compare-and-set as the protocol allows: the parameter is read right before each
                PARAM_SET, and a third value (neither this nor ours) is taken for somebody
                else's and not written over.

        Raises:
            ValueError: the value is not finite or does not fit a float32.
        """
        wanted = to_float32(value)
        phase = _Phase.SETTING if before is None else _Phase.CHECKING
        exchange = _Exchange(name, phase, self._settings.attempts, wanted, before)
        self._exchanges[name] = exchange
        self._exchanges.move_to_end(name, last=False)
        return self._flush(now)

    def cancel(self) -> None:
        """Forget every exchange; what was sent may still take effect."""
        self._exchanges.clear()

    def next_deadline(self) -> float | None:
        """When :meth:`tick` is due, None if nothing is under way."""
        pending = [e.deadline for e in self._exchanges.values() if e.deadline is not None]
        return min(pending, default=None)

    def feed(self, event: ParameterEvent, now: float) -> tuple[ParameterOutput, ...]:
        """Take one event of the wire."""
        match event:
            case ValueReceived(name, value):
                self._value(name, value, now)
            case ErrorReceived(name, code):
                self._error(name, code)
            case TextReceived(text) if text.startswith(DENIAL):
                for exchange in self._exchanges.values():
                    if exchange.wanted is not None and f"({exchange.name})" in text:
                        exchange.denied = True
            case TextReceived():
                pass
        return self._flush(now)

    def tick(self, now: float) -> tuple[ParameterOutput, ...]:
        """Let time pass: resend what is overdue, give up what was sent often enough."""
        for exchange in list(self._exchanges.values()):
            if exchange.deadline is not None and exchange.deadline <= now:
                self._overdue(exchange, now)
        return self._flush(now)

    def _value(self, name: str, value: float, now: float) -> None:
        previous = self._cache.get(name)
        exchange = self._exchanges.get(name)
        if previous is None and exchange is None and len(self._cache) >= limits.PARAMETERS_MAX:
            return  # no firmware has as many: somebody makes names up
        self._cache[name] = value
        if exchange is None or exchange.deadline is None:
            if previous != value:
                self._out.append(ValueChanged(name, previous, value))
            return
        exchange.seen = value
        if exchange.sets and exchange.before is not None:
            # Somebody else has written since we looked, perhaps before us, so that theirs is gone.
            exchange.overtaken |= value not in {exchange.before, exchange.wanted}
        match exchange.phase:
            case _Phase.READING:
                self._end(exchange, ValueRead(name, value))
            case _Phase.CHECKING if value in {exchange.before, exchange.wanted}:
                self._enter(exchange, _Phase.SETTING, now)
            case _Phase.CHECKING:
                self._end(exchange, SetFailed(name, Failure.CHANGED_BY_OTHER, value))
            case _Phase.SETTING:
                exchange.saved = value == exchange.wanted
                self._enter(exchange, _Phase.CONFIRMING, now)
            case _Phase.CONFIRMING:
                self._confirmed(exchange, value, now)

    def _confirmed(self, exchange: _Exchange, value: float, now: float) -> None:
        """A value arrived after a read that was to confirm a set."""
        if value == exchange.wanted and exchange.overtaken:
            self._end(exchange, SetFailed(exchange.name, Failure.CHANGED_BY_OTHER, value))
        elif value == exchange.wanted:
            if exchange.saved or exchange.sets >= exchange.attempts:
                self._end(exchange, SetDone(exchange.name, value, exchange.saved))
            else:  # in force, but not known to be stored: a repeated set is announced again
                self._enter(exchange, _Phase.SETTING, now)
        elif exchange.before is not None and value != exchange.before:
            self._end(exchange, SetFailed(exchange.name, Failure.CHANGED_BY_OTHER, value))
        elif exchange.denied:
            self._end(exchange, SetFailed(exchange.name, Failure.DENIED, value))
        elif exchange.sets >= exchange.attempts:
            self._end(exchange, SetFailed(exchange.name, Failure.NOT_TAKEN, value))
        elif now < exchange.set_at + self._settings.pause_s:
            # Not taken yet, or the word of somebody who talks faster than anything is written.
            exchange.phase = _Phase.SETTING
            exchange.deadline = exchange.set_at + self._settings.pause_s
        else:
            self._enter(exchange, _Phase.SETTING, now)

    def _error(self, name: str, code: ParameterErrorCode) -> None:
        exchange = self._exchanges.get(name)
        if exchange is None or exchange.deadline is None:
            return
        if code in (ParameterErrorCode.DOES_NOT_EXIST, ParameterErrorCode.COMPONENT_NOT_FOUND):
            failure = Failure.DOES_NOT_EXIST
        else:
            failure = Failure.DENIED
        self._fail(exchange, failure)

    def _fail(self, exchange: _Exchange, failure: Failure) -> None:
        if exchange.wanted is None:
            self._end(exchange, ReadFailed(exchange.name, failure))
        else:
            self._end(exchange, SetFailed(exchange.name, failure, exchange.seen))

    def _overdue(self, exchange: _Exchange, now: float) -> None:
        if exchange.phase is _Phase.SETTING:
            if exchange.sets >= exchange.attempts:
                # Perhaps it was taken and only the announcements are missing: ask.
                self._enter(exchange, _Phase.CONFIRMING, now)
            elif exchange.before is not None:
                self._enter(exchange, _Phase.CHECKING, now)
            else:
                self._send(exchange, now)
        elif exchange.tries >= exchange.attempts:
            self._fail(exchange, Failure.SILENT)
        else:
            self._send(exchange, now)

    def _enter(self, exchange: _Exchange, phase: _Phase, now: float) -> None:
        exchange.phase = phase
        exchange.tries = 0
        self._send(exchange, now)

    def _send(self, exchange: _Exchange, now: float) -> None:
        if exchange.phase is _Phase.SETTING and exchange.wanted is not None:
            exchange.sets += 1
            exchange.set_at = now
            attempt = exchange.sets
            self._out.append(SendParamSet(exchange.name, exchange.wanted))
        else:
            exchange.tries += 1
            attempt = exchange.tries
            self._out.append(SendParamRead(exchange.name))
        exchange.deadline = now + self._settings.timeout(attempt)

    def _end(self, exchange: _Exchange, result: ParameterResult) -> None:
        del self._exchanges[exchange.name]
        self._out.append(result)

    def _flush(self, now: float) -> tuple[ParameterOutput, ...]:
        """Start what the limit of requests in flight allows, and hand everything out."""
        running = sum(e.deadline is not None for e in self._exchanges.values())
        for exchange in self._exchanges.values():
            if running >= self._settings.in_flight:
                break
            if exchange.deadline is None:
                self._send(exchange, now)
                running += 1
        out, self._out = tuple(self._out), []
        return out
