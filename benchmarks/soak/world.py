"""What happens to a service while it lives."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import random
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path

from benchmarks.daemon import frames, later
from onboard.daemon.process.service import Service
from onboard.mavlink.dialect import mavlink

HOUR = 3600.0


class World:
    """Everything that happens to one service.

    Args:
        port: where it listens.
        flight: a recorded one, as a .tlog.
        chosen: how often what happens.
    """

    def __init__(self, port: int, flight: Path, chosen: argparse.Namespace) -> None:
        from tests.daemon.standing_vehicle import Vehicle

        self.happened: Counter[str] = Counter()
        self._port, self._flight = port, flight
        self._rng = random.Random(chosen.seed)  # noqa: S311 - chance, no secret
        self._incident_every = 60.0 * chosen.incident_every
        self._flight_every = 24.0 * HOUR / chosen.flights
        self.vehicle = Vehicle(port, rate=chosen.rate)
        self._loop = asyncio.get_running_loop()
        self._fly_at = self._loop.time() + HOUR
        self._visitors: list[asyncio.StreamWriter] = []

    async def live(self, service: Service, seconds: float) -> None:
        """So long; the last visitors leave at the end."""
        end = self._loop.time() + seconds
        while self._loop.time() < end:
            pause = self._rng.expovariate(1.0 / self._incident_every)
            await asyncio.sleep(max(0.0, min(pause, end - self._loop.time())))
            if self._loop.time() >= self._fly_at:
                self._fly_at += self._flight_every
                await self._fly()
            await self._incident(service)
        for visitor in self._visitors:
            visitor.close()
        self._visitors.clear()
        # The vehicle notes what it hears, for tests: that memory is not the service's.
        self.vehicle.heard.clear()
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
        vehicle, opener, began = self.vehicle, mavlink.MAVLink(None), self._loop.time()
        vehicle.stop_talking()
        shift = vehicle.boot_ms * 1e-3
        for t, raw in frames(self._flight):
            if (wait := began + t - self._loop.time()) > 0.0:
                await asyncio.sleep(wait)
            message = opener.decode(bytearray(later(raw, shift)))
            if message.get_type() != "PARAM_VALUE":
                vehicle.send(message)
        vehicle.boot_ms += 1e3 * (self._loop.time() - began)
        self._speak_again()

    def _speak_again(self) -> None:
        vehicle = self.vehicle
        vehicle._task = asyncio.create_task(vehicle._stream(), name="vehicle")  # noqa: SLF001

    async def _reboot(self, _: Service) -> None:
        self.vehicle.reboot()

    async def _silence(self, _: Service) -> None:
        self.vehicle.stop_talking()
        await asyncio.sleep(self._rng.uniform(5.0, 300.0))
        self._speak_again()

    async def _other_port(self, _: Service) -> None:
        """As behind a router that was restarted."""
        await self.vehicle.__aexit__()
        await self.vehicle.__aenter__()

    async def _set_by_other(self, _: Service) -> None:
        self.vehicle.set_by_other("INS_ACCOFFS_X", self._rng.uniform(-0.3, 0.3))

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
