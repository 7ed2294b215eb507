"""An in-memory autopilot's parameter store with ArduPilot's quirks, and a bad link to it.

Independent of the client: written from the behaviour of GCS_Param.cpp and AP_Param.cpp.

* PARAM_SET: unknown name, NaN or infinity: no reply.  Denied: STATUSTEXT and the old value.
  Otherwise RAM changes at once, the value is queued for storing and announced when stored.
* storing the x element of a vector announces all three elements.
* PARAM_REQUEST_READ by name: queue of 20, answered later with index 65535 too.
* reboot: RAM is reloaded from storage; silent for a while; what was queued is lost.
* storage full: what has a place there is stored as ever; of a parameter that never left its
  default RAM changes, but nothing is stored and nothing announced.
"""

import heapq
import math
import random
import struct
from dataclasses import dataclass, field

from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    ParameterErrorCode,
    SendParamRead,
    SendParamSet,
    TextReceived,
    ValueReceived,
)

VECTORS = ("OFFS_X", "SCAL_X")


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def accelerometer_parameters(imu=1, scale=(1.0, 1.0, 1.0), offset=(0.02, -0.03, 0.04), device=3e6):
    n = "" if imu == 1 else str(imu)
    names = {f"INS_ACC{n}_ID": device}
    for axis, s, o in zip("XYZ", scale, offset, strict=True):
        names[f"INS_ACC{n}SCAL_{axis}"] = s
        names[f"INS_ACC{n}OFFS_{axis}"] = o
    return names


class Autopilot:
    """Parameters of one autopilot; ``receive`` takes actions, ``step`` gives events."""

    def __init__(self, parameters, *, store_delay=0.02, reply_delay=0.005):
        self.ram = {k: float32(v) for k, v in parameters.items()}
        self.stored = dict(self.ram)
        self.denied = set()
        self.full = False
        self.places = set()  # names that have a place in storage
        self.speaks_errors = False
        self.store_delay, self.reply_delay = store_delay, reply_delay
        self.silent_until = -math.inf
        self.history = []  # every write that took effect
        self.states = [dict(self.ram)]  # every state that was in force
        self._due = []
        self._serial = 0
        self._reads = 0

    def receive(self, action, now):
        if now < self.silent_until:
            return
        match action:
            case SendParamRead(name):
                if self._reads < 20:
                    self._reads += 1
                    self._later(now + self.reply_delay, "read", name)
            case SendParamSet(name, value):
                self._set(name, float32(value), now)

    def set_by_other(self, name, value, now):
        self._set(name, float32(value), now)

    def reboot(self, now, silence=3.0):
        self.ram = dict(self.stored)
        self.states.append(dict(self.ram))
        self._due.clear()
        self._reads = 0
        self.silent_until = now + silence

    def due(self):
        return self._due[0][0] if self._due else math.inf

    def step(self, now):
        events = []
        while self._due and self._due[0][0] <= now:
            _, _, kind, name = heapq.heappop(self._due)
            if kind == "read":
                self._reads -= 1
                if name in self.ram:
                    events.append(self._value(name))
                elif self.speaks_errors:
                    events.append(ErrorReceived(name, ParameterErrorCode.DOES_NOT_EXIST))
            elif kind == "store":
                if self.full and name not in self.places:
                    continue
                self.places.add(name)
                self.stored[name] = self.ram[name]
                events += [self._value(n) for n in self._announced(name)]
            elif kind == "old":
                events += [TextReceived(f"Param write denied ({name})"), self._value(name)]
        return events

    def _set(self, name, value, now):
        if name not in self.ram or not math.isfinite(value):
            return
        if name in self.denied:
            self._later(now, "old", name)
            return
        self.ram[name] = value
        self.history.append((name, value))
        self.states.append(dict(self.ram))
        self._later(now + self.store_delay, "store", name)

    def _announced(self, name):
        if name.endswith(VECTORS):
            return [name[:-1] + axis for axis in "XYZ"]
        return [name]

    def _value(self, name):
        return ValueReceived(name, self.ram[name], 65535, len(self.ram))

    def _later(self, at, kind, name):
        self._serial += 1
        heapq.heappush(self._due, (at, self._serial, kind, name))


@dataclass
class Weather:
    """What a link does to packets, each way; ``longest`` bounds every delay."""

    loss: float = 0.0
    duplication: float = 0.0
    shortest: float = 0.005
    longest: float = 0.02
    late: float = 0.0  # share of packets that take up to ``latest``
    latest: float = 1.5


@dataclass
class Link:
    """Two queues of packets in virtual time; survives a crash of our side."""

    weather: Weather
    random: random.Random
    cut: bool = False
    _flying: list = field(default_factory=list)
    _serial: int = 0

    def send(self, packet, to, now):
        if self.cut:
            return
        copies = 2 if self.random.random() < self.weather.duplication else 1
        for _ in range(copies):
            if self.random.random() < self.weather.loss:
                continue
            delay = self.random.uniform(self.weather.shortest, self.weather.longest)
            if self.random.random() < self.weather.late:
                delay = self.random.uniform(self.weather.longest, self.weather.latest)
            self._serial += 1
            heapq.heappush(self._flying, (now + delay, self._serial, to, packet))

    def due(self):
        return self._flying[0][0] if self._flying else math.inf

    def arrived(self, now):
        found = []
        while self._flying and self._flying[0][0] <= now:
            _, _, to, packet = heapq.heappop(self._flying)
            found.append((to, packet))
        return found


class World:
    """One autopilot, one link, virtual time, and whatever client is plugged in.

    ``client`` needs ``feed``, ``tick`` and ``next_deadline``; ``act`` gets each of its outputs that
    is not for the wire, and returns further outputs.
    """

    def __init__(self, autopilot, weather=None, seed=0):
        self.autopilot = autopilot
        self.link = Link(weather or Weather(), random.Random(seed))
        self.now = 0.0
        self.client = None
        self.outputs = []
        self.sent = []
        self.agenda = []  # (time, callable)

    def plug(self, client):
        self.client = client

    def at(self, when, what):
        self.agenda.append((when, what))
        self.agenda.sort(key=lambda item: item[0])

    def handle(self, outputs):
        for output in outputs:
            if isinstance(output, SendParamRead | SendParamSet):
                self.sent.append(output)
                self.link.send(output, "autopilot", self.now)
            else:
                self.outputs.append(output)
                self.act(output)

    def beat_due(self):
        """When the autopilot's next HEARTBEAT is due, for subclasses that need them."""
        return math.inf

    def beat(self):
        """For subclasses: it is due."""

    def act(self, output):
        """For subclasses: journal and the like."""

    def feed(self, event):
        if self.client is not None:
            self.handle(self.client.feed(event, self.now))

    def run(self, until=math.inf, stop=lambda: False, limit=100_000):
        """Let virtual time pass, until ``until``, ``stop()`` or nothing is left to happen."""
        for _ in range(limit):
            if stop():
                return
            deadline = self.client.next_deadline() if self.client is not None else None
            following = min(
                self.autopilot.due(),
                self.link.due(),
                math.inf if deadline is None else deadline,
                self.agenda[0][0] if self.agenda else math.inf,
                self.beat_due(),
            )
            if following > until or following == math.inf:
                self.now = max(self.now, until) if until < math.inf else self.now
                return
            self.now = max(self.now, following)
            self._happen()
        raise AssertionError("it never comes to rest")

    def _happen(self):
        if self.beat_due() <= self.now:
            self.beat()
        while self.agenda and self.agenda[0][0] <= self.now:
            self.agenda.pop(0)[1]()
        for event in self.autopilot.step(self.now):
            self.link.send(event, "us", self.now)
        for to, packet in self.link.arrived(self.now):
            if to == "autopilot":
                self.autopilot.receive(packet, self.now)
            else:
                self.feed(packet)
        if self.client is not None:
            deadline = self.client.next_deadline()
            if deadline is not None and deadline <= self.now:
                self.handle(self.client.tick(self.now))
