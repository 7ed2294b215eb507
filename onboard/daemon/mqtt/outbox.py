"""What has to reach the broker: the last of each retained topic, and events in their order.

Nothing leaves the outbox before the broker has confirmed it, and a new connection gets every
retained document again: a broker that lost its memory has it back at once.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from onboard.daemon.mqtt import limits

T = TypeVar("T")


class Parcel(NamedTuple):
    """One publication; ``topic`` is below the prefix, or a whole one after a stroke."""

    topic: str
    payload: bytes
    retain: bool


class Outbox:
    """Keeps what is to be sent."""

    def __init__(self, events_max: int = limits.EVENTS_MAX) -> None:
        self.dropped = 0
        self.too_large = math.inf
        """bytes; what is as large is not sent."""
        self._retained: dict[str, bytes] = {}
        self._due: dict[str, None] = {}
        self._events: deque[Parcel] = deque()
        self._events_max = events_max

    def retain(self, topic: str, payload: bytes) -> None:
        """Replace a retained document; the same one again is not sent again."""
        if self._retained.get(topic) != payload:
            self._retained[topic] = payload
            self._due[topic] = None

    def event(self, topic: str, payload: bytes) -> None:
        """Add something that happened."""
        self._events.append(Parcel(topic, payload, retain=False))
        if len(self._events) > self._events_max:
            self._events.popleft()
            self.dropped += 1

    def connected(self) -> None:
        """A new connection: nobody knows what the broker still has."""
        self._due = dict.fromkeys(self._retained)

    def next(self) -> Parcel | None:
        """What to send now, None if nothing; retained documents go first."""
        for topic in self._due:
            if len(self._retained[topic]) < self.too_large:
                return Parcel(topic, self._retained[topic], retain=True)
        while self._events and len(self._events[0].payload) >= self.too_large:
            self._events.popleft()
            self.dropped += 1
        return self._events[0] if self._events else None

    def confirm(self, parcel: Parcel) -> None:
        """The broker has it; a document that was replaced meanwhile stays due."""
        if not parcel.retain:
            if self._events and self._events[0] is parcel:
                self._events.popleft()
        elif self._retained[parcel.topic] == parcel.payload:
            self._due.pop(parcel.topic, None)
        else:
            # Behind the others, or a slow line would carry this one topic and nothing else.
            self._due[parcel.topic] = self._due.pop(parcel.topic, None)


def newer(before: Sequence[T], now: Sequence[T]) -> Sequence[T]:
    """Entries of a rolling list that were not in its earlier state."""
    if not before:
        return now
    last = before[-1]
    for index in range(len(now) - 1, -1, -1):
        if now[index] == last:
            return now[index + 1 :]
    return now
