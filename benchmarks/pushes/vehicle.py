"""An autopilot's parameters, its HEARTBEATs, and the link to it, in virtual time."""

from __future__ import annotations

import heapq
import itertools
import math
import random
import struct
from collections.abc import Callable
from typing import TypeVar

from benchmarks.pushes.faults import Weather
from onboard.mavlink.parameter_messages import (
    SendAction,
    SendParamRead,
    TextReceived,
    ValueReceived,
)
from onboard.push.signals import Heartbeat, TransactionEvent

Packet = TypeVar("Packet")
REPLY_S = 0.005
QUEUE = 20


def float32(value: float) -> float:
    """The nearest float32."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


class Agenda:
    """What happens when; first come, first served among what happens at once."""

    def __init__(self) -> None:
        self.now = 0.0
        self._due: list[tuple[float, int, Callable[[], object]]] = []
        self._number = itertools.count()

    def at(self, when: float, what: Callable[[], object]) -> None:
        """Have ``what()`` called at that time."""
        heapq.heappush(self._due, (max(when, self.now), next(self._number), what))

    def next(self) -> float:
        """When something happens next, s; inf: never."""
        return self._due[0][0] if self._due else math.inf

    def step(self) -> None:
        """Let the next thing happen."""
        self.now, _, what = heapq.heappop(self._due)
        what()


class Link:
    """Packets either way, lost, repeated, late, in any order."""

    def __init__(self, agenda: Agenda, weather: Weather, rng: random.Random) -> None:
        self.cut = False
        self.weather = weather
        self._agenda, self._rng = agenda, rng

    def carry(self, packet: Packet, deliver: Callable[[Packet], None]) -> None:
        """Deliver a packet, or not, or twice."""
        weather, rng = self.weather, self._rng
        if self.cut:
            return
        for _ in range(2 if rng.random() < weather.duplication else 1):
            if rng.random() < weather.loss:
                continue
            delay = rng.uniform(0.005, 0.02)
            if rng.random() < weather.late:
                delay = rng.uniform(0.02, weather.latest)
            self._agenda.at(self._agenda.now + delay, lambda: deliver(packet))


class Autopilot:
    """Parameters as ArduPilot keeps them, and a HEARTBEAT a second; see tests/autopilot_parameters.

    ``hear`` is called with each event that reaches the other side.
    """

    def __init__(
        self,
        parameters: dict[str, float],
        agenda: Agenda,
        link: Link,
        hear: Callable[[TransactionEvent], None],
    ) -> None:
        self.ram = {name: float32(value) for name, value in parameters.items()}
        self.stored = dict(self.ram)
        self.denied: set[str] = set()
        self.full = False
        self.armed = False
        self.flying = False
        self.silent_until = self.held_until = -1.0
        """Until then it says nothing; until then nothing of what it says arrives."""
        self.boots = 0
        self.lost = False
        """Something was not stored."""
        self.store_delay = 0.02
        self.quantum = 0.0
        self.wrong_echo = 0.0
        self.touched: set[str] = set()
        """What somebody else has written."""
        self._agenda, self._link, self._hear = agenda, link, hear
        self._rng = link._rng  # noqa: SLF001 - one source of chance
        self.changed: Callable[[], None] = _nothing
        """Called when a value has changed."""
        self._reads = 0
        self._places: set[str] = set()
        agenda.at(0.3, self._beat)

    def receive(self, action: SendAction) -> None:
        """A packet has come."""
        if self._agenda.now < self.silent_until:
            return
        if isinstance(action, SendParamRead):
            if self._reads < QUEUE and action.name in self.ram:
                self._reads += 1
                self._later(REPLY_S, lambda: self._read(action.name))
        else:
            self.set(action.name, action.value)

    def set(self, name: str, value: float) -> None:
        """Somebody writes."""
        if name in self.denied:
            self._say(TextReceived(f"Param write denied ({name})"))
            self._say(self._value(name))
            return
        if self.quantum:
            value = round(value / self.quantum) * self.quantum
        self.ram[name] = float32(value)
        self.changed()
        self._later(self.store_delay, lambda: self._store(name))

    def reboot(self, silence: float) -> None:
        """Power is off for a moment."""
        self.ram = dict(self.stored)
        self.boots += 1
        self._reads = 0
        self.armed = self.flying = False
        self.silent_until = self._agenda.now + silence

    def beat_now(self) -> None:
        """A HEARTBEAT out of turn."""
        if self._agenda.now >= self.silent_until:
            self._say(Heartbeat(self.armed))

    def _beat(self) -> None:
        self.beat_now()
        self._agenda.at(self._agenda.now + 1.0, self._beat)

    def _later(self, delay: float, what: Callable[[], object]) -> None:
        boots = self.boots
        self._agenda.at(self._agenda.now + delay, lambda: what() if boots == self.boots else None)

    def _read(self, name: str) -> None:
        self._reads -= 1
        self._say(self._value(name))

    def _store(self, name: str) -> None:
        if self.full and name not in self._places:
            self.lost = True
            return
        self._places.add(name)
        self.stored[name] = self.ram[name]
        names = [name[:-1] + axis for axis in "XYZ"] if name.endswith("_X") else [name]
        for one in names:
            self._say(self._value(one))

    def _value(self, name: str) -> ValueReceived:
        value = self.ram[name]
        if self.wrong_echo and self._rng.random() < self.wrong_echo:
            value = float32(value + self._rng.choice((1e-7, self._rng.uniform(-1.0, 1.0))))
        return ValueReceived(name, value)

    def _say(self, event: TransactionEvent) -> None:
        late = self.held_until - self._agenda.now
        if late <= 0.0:
            self._link.carry(event, self._hear)
            return
        held = Heartbeat(event.armed, late) if isinstance(event, Heartbeat) else event
        self._agenda.at(self.held_until, lambda: self._link.carry(held, self._hear))


def _nothing() -> None:
    pass
