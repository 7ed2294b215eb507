"""Days of the service at speed: what it holds on to must not grow.

The whole service on an event loop whose clock jumps, with real sockets on loopback.  A vehicle
stands and says what a standing vehicle says; every four hours it flies a recorded flight.
Meanwhile, at random, every two and a half minutes: it reboots, falls silent, is heard on another
port, has its parameters set by others; strangers speak in its name and rubbish; visitors read the
page, follow it live, or come and say nothing.  Every few simulated hours: resident memory, objects,
descriptors, tasks, bytes on disk.  ``python -m benchmarks.soak --hours 24``.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import os
import random
import socket
import sys
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from benchmarks.daemon import cpu_and_memory, frames, in_a_process, later, record_landed
from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import Message
from sitl.virtual_time import VirtualTimeLoop

HOUR = 3600.0
FLIGHT_EVERY_S, FLIGHT_S = 4.0 * HOUR, 200.0
INCIDENT_EVERY_S = 150.0
ROW_S = 4.0 * HOUR
RATES = {"RAW_IMU": 50.0, "ATTITUDE": 20.0, "GPS_RAW_INT": 5.0}
HZ = 2.0
"""Samples a second of a vehicle that stands."""
EPOCH = 1_800_000_000.0
"""Unix time at which the clock begins."""


@dataclass(frozen=True, slots=True)
class Row:
    """What the service holds on to now; memory in MB, the disk in kB."""

    hour: float
    memory: float
    objects: int
    descriptors: int
    tasks: int
    disk: float
    notices: int

    def __str__(self) -> str:
        return (
            f"| {self.hour:.0f} | {self.memory:.1f} | {self.objects:,} | {self.descriptors} "
            f"| {self.tasks} | {self.disk:.0f} | {self.notices} |"
        )


HEAD = (
    "| hour | memory, MB | objects | descriptors | tasks | state, kB | notices |\n"
    "|---|---|---|---|---|---|---|"
)


def measured(service: Service, folder: Path, began: float) -> Row:
    """How it is now."""
    gc.collect()
    return Row(
        hour=(asyncio.get_running_loop().time() - began) / HOUR,
        memory=cpu_and_memory(os.getpid())[1],
        objects=len(gc.get_objects()),
        descriptors=len(os.listdir("/proc/self/fd")),
        tasks=len(asyncio.all_tasks()),
        disk=sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) / 1024,
        notices=len(service.parts.notices.kept),
    )


class World:
    """Everything that happens to one service.

    Args:
        port: where it listens.
        flight: a recorded one, as a .tlog.
        seed: of what happens when.
    """

    def __init__(self, port: int, flight: Path, seed: int) -> None:
        from tests.daemon.standing_vehicle import Vehicle

        self.happened: Counter[str] = Counter()
        self._port, self._flight = port, flight
        self._rng = random.Random(seed)  # noqa: S311 - chance, no secret
        self._vehicle = Vehicle(port, rate=HZ)
        self._loop = asyncio.get_running_loop()
        self._visitors: list[asyncio.StreamWriter] = []

    async def live(self, service: Service, seconds: float) -> None:
        """So long, with one flight; the last visitors leave at the end."""
        async with self._vehicle:
            end = self._loop.time() + seconds
            fly_at = self._loop.time() + 0.5 * FLIGHT_EVERY_S
            while self._loop.time() < end:
                pause = self._rng.expovariate(1.0 / INCIDENT_EVERY_S)
                await asyncio.sleep(max(0.0, min(pause, end - self._loop.time())))
                if self._loop.time() >= fly_at:
                    fly_at += FLIGHT_EVERY_S
                    await self._fly()
                await self._incident(service)
        for visitor in self._visitors:
            visitor.close()
        self._visitors.clear()
        await asyncio.sleep(0.1)

    async def _incident(self, service: Service) -> None:
        name = self._rng.choice(
            ("reboot", "silence", "other_port", "set_by_other", "stranger", "rubbish", "visit",
             "follow", "idle")
        )  # fmt: skip
        self.happened[name] += 1
        await getattr(self, f"_{name}")(service)

    async def _fly(self) -> None:
        """The recorded flight, on the vehicle's clock."""
        self.happened["flight"] += 1
        vehicle, codec, began = self._vehicle, Codec(), self._loop.time()
        vehicle.stop_talking()
        shift = vehicle.boot_ms * 1e-3
        for t, raw in frames(self._flight):
            if (wait := began + t - self._loop.time()) > 0.0:
                await asyncio.sleep(wait)
            for frame in codec.feed(raw):
                if frame.message is not None and frame.message.get_type() != "PARAM_VALUE":
                    vehicle.send(self._shifted(frame.message, shift))
        vehicle.boot_ms += 1e3 * (self._loop.time() - began)
        self._speak_again()

    @staticmethod
    def _shifted(message: Message, seconds: float) -> Message:
        later(message, seconds)
        if message.get_type() == "SERVO_OUTPUT_RAW":
            message.time_usec %= 1 << 32
        return message

    def _speak_again(self) -> None:
        vehicle = self._vehicle
        vehicle._task = asyncio.create_task(vehicle._stream(), name="vehicle")  # noqa: SLF001

    async def _reboot(self, _: Service) -> None:
        self._vehicle.reboot()

    async def _silence(self, _: Service) -> None:
        self._vehicle.stop_talking()
        await asyncio.sleep(self._rng.uniform(5.0, 300.0))
        self._speak_again()

    async def _other_port(self, _: Service) -> None:
        """As behind a router that was restarted."""
        await self._vehicle.__aexit__()
        await self._vehicle.__aenter__()

    async def _set_by_other(self, _: Service) -> None:
        self._vehicle.set_by_other("INS_ACCOFFS_X", self._rng.uniform(-0.3, 0.3))

    async def _stranger(self, _: Service) -> None:
        from tests.daemon.strangers import Stranger

        with Stranger(self._port) as stranger:
            system = self._rng.choice((1, 42, self._rng.randrange(1, 250)))
            for _ in range(30):
                stranger.beat(armed=self._rng.random() < 0.2, system=system)
                stranger.value(f"MADE_UP_{self._rng.randrange(100_000)}", 1.0, system=system)
                await asyncio.sleep(1.0)

    async def _rubbish(self, _: Service) -> None:
        from tests.daemon.strangers import Stranger

        with contextlib.ExitStack() as stack:
            for _ in range(40):
                one = stack.enter_context(Stranger(self._port))
                one.raw(self._rng.randbytes(self._rng.randrange(1, 2000)))
            await asyncio.sleep(1.0)

    async def _visit(self, service: Service) -> None:
        async with self._door(service, "/api/snapshot") as (reader, _):
            if b"onboard.state" not in await reader.read():
                self.happened["visit without an answer"] += 1

    async def _follow(self, service: Service) -> None:
        """Follows the page for ten minutes, and reads nothing of it."""
        async with self._door(service, "/api/live"):
            await asyncio.sleep(600.0)

    async def _idle(self, service: Service) -> None:
        """Comes, says nothing, and is not seen to leave."""
        _, writer = await asyncio.open_connection("127.0.0.1", _port(service))
        self._visitors.append(writer)
        for gone in self._visitors[:-3]:
            gone.close()
        del self._visitors[:-3]

    @contextlib.asynccontextmanager
    async def _door(
        self, service: Service, path: str
    ) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
        reader, writer = await asyncio.open_connection("127.0.0.1", _port(service))
        try:
            writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n".encode())
            writer.write(b"Connection: close\r\n\r\n")
            yield reader, writer
        finally:
            writer.close()


def _port(service: Service) -> int:
    """Of its page."""
    assert service.server is not None
    return int(service.server.url.rpartition(":")[2])


class Prompt:
    """Instead of the learner's thread, which the loop would have to wait for."""

    def __init__(self, _name: str) -> None:
        pass

    async def call(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - any call
        """Compute it now."""
        return function(*args, **kwargs)

    def dismiss(self) -> None:
        """There is no thread to end."""

    async def close(self) -> None:
        """There is no thread to end."""


@contextlib.contextmanager
def fitted() -> Iterator[None]:
    """While this lasts the learner computes at once, and disks are quick."""
    with (
        patch("onboard.daemon.learning.handover.Worker", Prompt),
        patch.object(os, "fsync", lambda _: None),
    ):
        yield


async def soak(hours: float, seed: int, flight: Path, folder: Path) -> list[Row]:
    """The rows, printed as they come."""
    loop = asyncio.get_running_loop()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    document = {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"], "heartbeat_limit_s": 600.0},
        "state": {"directory": str(folder)},
        "http": {"port": 0},
    }
    service = Service(
        from_mapping(document, source="soak"),
        clock=loop.time,
        wall_clock=lambda: EPOCH + loop.time(),
    )
    task = asyncio.create_task(service.run(), name="service")
    await service.ready.wait()
    world, rows, began = World(port, flight, seed), [], loop.time()
    print(HEAD, flush=True)
    try:
        left = hours * HOUR
        while left > 0.0 and not task.done():
            await world.live(service, min(ROW_S, left))
            left -= ROW_S
            rows.append(measured(service, folder, began))
            print(rows[-1], flush=True)
        print(dict(world.happened), service.snapshot().counters, sep="\n")
    finally:
        service.stop()
        await task
    return rows


def main() -> int:
    """Exit status 1 if something grows."""
    parser = argparse.ArgumentParser(prog="benchmarks.soak", description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, fitted():
        flight = Path(folder) / "flight.tlog"
        in_a_process(record_landed, str(flight), FLIGHT_S, RATES).join()
        state = Path(folder) / "state"
        with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
            rows = runner.run(soak(chosen.hours, chosen.seed, flight, state))
    print(f"{time.monotonic() - began:.0f} s")
    return 0 if rows and flat(rows) else 1


def flat(rows: list[Row]) -> bool:
    """Whether nothing is more at the end than it was at first, chance set aside."""
    first, last = rows[0], rows[-1]
    return (
        last.memory < 1.1 * first.memory
        and last.descriptors <= first.descriptors + 8
        and last.tasks <= first.tasks + 8
    )


if __name__ == "__main__":
    sys.exit(main())
