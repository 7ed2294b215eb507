"""The other side of the link, for tests: messages as they arrive, and sockets that are none."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Iterator

from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.endpoint import Endpoint, EndpointKind


def heartbeat(vehicle=2, autopilot=3, base_mode=0):
    return mavlink.MAVLink_heartbeat_message(vehicle, autopilot, base_mode, 0, 4, 3)


def attitude(time_boot_ms, roll=0.125):
    return mavlink.MAVLink_attitude_message(time_boot_ms, roll, 0.25, 0.5, 0.0, 0.0, 0.0)


def raw_imu(time_usec, acc=(10, -20, -1000), gyro=(1, 2, 3), temperature=0, imu=0):
    return mavlink.MAVLink_raw_imu_message(time_usec, *acc, *gyro, 0, 0, 0, imu, temperature)


def received(message: Message, system=1, component=1) -> Message:
    """The message as a receiver gets it: through the wire, with its header."""
    frames = Codec().feed(Codec(system=system, component=component).encode(message))
    assert len(frames) == 1
    return frames[0].message


class FakeAir:
    """Stands in for the sockets: transports whose other end is a callback of the test.

    ``failures`` are raised by the next attempts to open, one each.
    """

    def __init__(self) -> None:
        self.transports: list[FakeTransport] = []
        self.opened_at: list[float] = []
        self.failures: list[Exception] = []

    async def open(
        self, endpoint: Endpoint, receive, lost, *, linger: float, first
    ) -> FakeTransport:
        self.opened_at.append(asyncio.get_running_loop().time())
        if self.failures:
            raise self.failures.pop(0)
        transport = FakeTransport(endpoint, receive, lost)
        self.transports.append(transport)
        return transport


class FakeTransport:
    def __init__(self, endpoint: Endpoint, receive: Callable, lost: Callable) -> None:
        self.endpoint = endpoint
        self.receive = receive
        self.lost = lost
        self.dropped = self.refused = 0
        self.closed = False
        self.lingers: list[float] = []
        self.reads = 0
        self.codec = Codec(system=1, component=1)
        listening = endpoint.kind is EndpointKind.UDP_IN
        self.address = ("127.0.0.1", 40_000) if listening else None
        self.heard: list[Message] = []
        self.answer: Callable[[Message], Iterator[Message]] | None = None
        self._inbound = Codec()

    def write(self, data: bytes, to=()) -> None:
        assert not self.closed
        for frame in self._inbound.feed(data):
            self.heard.append(frame.message)
            if self.answer is not None:
                for message in self.answer(frame.message):
                    asyncio.get_running_loop().call_soon(self.say, message)

    def pace(self, linger: float) -> None:
        self.lingers.append(linger)

    def read(self) -> None:
        self.reads += 1

    def close(self) -> None:
        self.closed = True

    def say(self, message: Message, codec: Codec | None = None, address=None) -> None:
        if not self.closed:
            self.receive((codec or self.codec).encode(message), address or self.address)


class LossyLine:
    """Carries messages one way with loss, duplication and reordering, all from one seed."""

    def __init__(self, seed: int, *, loss=0.0, duplication=0.0, reordering=0.0) -> None:
        self._rng = random.Random(seed)
        self._loss, self._duplication, self._reordering = loss, duplication, reordering
        self._held: list[Message] = []

    def carry(self, messages) -> list[Message]:
        out: list[Message] = []
        for message in messages:
            if self._rng.random() < self._loss:
                continue
            if self._rng.random() < self._reordering:
                self._held.append(message)
                continue
            out.append(message)
            if self._rng.random() < self._duplication:
                out.append(message)
            out.extend(self._held)
            self._held.clear()
        return out
