"""The autopilot's boot clock against ours, by MAVLink TIMESYNC; sans-IO.

We send our time as ``ts1``; the answer carries it back with the autopilot's boot time
``tc1``.  The boot clock lies within ``[tc1 - round trip, tc1]`` of the moment we sent, so the
answer with the shortest round trip tells most; the others only bound it (the minimum-delay
filter of NTP's clock filter, RFC 5905 section 10).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from onboard.mavlink.dialect import Message, mavlink

INTERVAL_S = 1.0
FIRST_INTERVAL_S = 0.05
"""At first at every poll, until some answers have come."""
FIRST_ANSWERS = 8
WINDOW = 30
"""Answers kept: half a minute, in which crystals of 50 ppm drift apart by 1.5 ms."""
DRIFT = 100e-6
MAX_ROUND_TRIP_S = 2.0
STEP_ANSWERS = 3
"""So many answers in a row that contradict the estimate mean that a clock has stepped."""


@dataclass(frozen=True, slots=True)
class _Answer:
    sent: float
    received: float
    offset: float
    half_trip: float


class TimeSync:
    """Asks, filters, converts.

    ``offset`` is boot time minus ours (s); the clock is whatever ``now`` is passed in.  It
    has the shape of a :class:`onboard.mavlink.link.Participant`.
    """

    names: ClassVar[tuple[str, ...]] = ("TIMESYNC",)

    def __init__(self) -> None:
        self.rejected = 0
        self.steps = 0
        self._answers: deque[_Answer] = deque(maxlen=WINDOW)
        self._contradictions: list[_Answer] = []
        self._pending: dict[int, float] = {}
        self._next = 0.0
        self._target: tuple[int, int] | None = None

    def start(self, system: int, component: int, now: float) -> None:
        """Begin with this autopilot, or again after it rebooted: nothing known holds any more."""
        self._target = (system, component)
        self._answers.clear()
        self._contradictions.clear()
        self._pending.clear()
        self._next = now

    def poll(self, now: float) -> Sequence[Message]:
        """The request that is due, if one is."""
        if self._target is None or now < self._next:
            return ()
        many = len(self._answers) >= FIRST_ANSWERS
        self._next = now + (INTERVAL_S if many else FIRST_INTERVAL_S)
        self._pending = {
            stamp: sent for stamp, sent in self._pending.items() if now - sent < MAX_ROUND_TRIP_S
        }
        stamp = round(now * 1e9)
        self._pending[stamp] = now
        return (mavlink.MAVLink_timesync_message(0, stamp),)

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take a TIMESYNC.  Requests, other people's answers and repeated ones are ignored."""
        source = (message.get_srcSystem(), message.get_srcComponent())
        if message.tc1 == 0 or source != self._target:
            return ()
        sent = self._pending.pop(message.ts1, None)
        trip = 0.0 if sent is None else now - sent
        if sent is None or not 0.0 <= trip <= MAX_ROUND_TRIP_S:
            self.rejected += 1
            return ()
        answer = _Answer(sent, now, message.tc1 * 1e-9 - (sent + now) / 2.0, trip / 2.0)
        best = self._best(now)
        if best is None or abs(answer.offset - best.offset) <= (
            answer.half_trip + self._error(best, now)
        ):
            self._answers.append(answer)
            self._contradictions.clear()
            return ()
        self.rejected += 1
        self._contradictions.append(answer)
        if len(self._contradictions) >= STEP_ANSWERS:
            self.steps += 1
            self._answers.clear()
            self._answers.extend(self._contradictions)
            self._contradictions.clear()
        return ()

    @property
    def offset(self) -> float | None:
        """Boot time minus our time, s; None until an answer has come."""
        best = self._best(self._answers[-1].received) if self._answers else None
        return None if best is None else best.offset

    def uncertainty(self, now: float) -> float | None:
        """Bound of the error of ``offset``, s: half the best round trip, plus drift since."""
        best = self._best(now)
        return None if best is None else self._error(best, now)

    def to_boot(self, local: float) -> float | None:
        """Boot time at our time ``local``."""
        offset = self.offset
        return None if offset is None else local + offset

    def to_local(self, boot: float) -> float | None:
        """Our time at boot time ``boot``."""
        offset = self.offset
        return None if offset is None else boot - offset

    def _best(self, now: float) -> _Answer | None:
        return min(self._answers, key=lambda answer: self._error(answer, now), default=None)

    @staticmethod
    def _error(answer: _Answer, now: float) -> float:
        return answer.half_trip + DRIFT * abs(now - answer.received)
