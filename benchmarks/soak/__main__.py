"""Days of the service at speed: what it holds on to must not grow.

The whole service on an event loop whose clock jumps, with real sockets on loopback.  A vehicle
stands and says what a standing vehicle says; a few times a day it flies a recorded flight.
Meanwhile, at random, every few minutes: it reboots, falls silent, is heard on another
port, has its parameters set by others; strangers speak in its name and rubbish; visitors read the
page, follow it live, or come and say nothing.  Every simulated hour: resident memory, what is held
of it, objects, descriptors, tasks, bytes on disk; at the end the slope of each with its sigma.
With ``PYTHONMALLOC=malloc`` what is held is exact (:mod:`benchmarks.soak.allocator`).
``python -m benchmarks.soak --hours 168 --flights 2 --rate 1``.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

from benchmarks.daemon import cpu_and_memory, in_a_process, record_landed
from benchmarks.soak.allocator import held_mb
from benchmarks.soak.rows import HEAD, Row, judge
from benchmarks.soak.world import HOUR, World
from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from sitl.virtual_time import VirtualTimeLoop

FLIGHT_S = 200.0
ROW_S = HOUR
RATES = {"RAW_IMU": 25.0, "ATTITUDE": 10.0, "GPS_RAW_INT": 5.0}
EPOCH = 1_800_000_000.0
"""Unix time at which the clock begins."""


def measured(service: Service, folder: Path, began: float) -> Row:
    """How it is now."""
    gc.collect()
    return Row(
        hour=(asyncio.get_running_loop().time() - began) / HOUR,
        memory=cpu_and_memory(os.getpid())[1],
        held=held_mb(),
        objects=len(gc.get_objects()),
        descriptors=len(os.listdir("/proc/self/fd")),
        tasks=len(asyncio.all_tasks()),
        disk=sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) / 1024,
        notices=len(service.parts.notices.kept),
    )


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
    """While this lasts the learner computes at once, disks are quick, and looks are rarer."""
    with (
        patch("onboard.daemon.learning.handover.Worker", Prompt),
        patch("onboard.mavlink.limits.TICK_S", 0.5),
        patch("onboard.daemon.learning.limits.BATCH_S", 1.0),
        patch.object(os, "fsync", lambda _: None),
    ):
        yield


async def soak(chosen: argparse.Namespace, flight: Path, folder: Path) -> tuple[list[Row], int]:
    """The rows, printed as they come, and how many flights the service has not heard to the end."""
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
    world, rows, began = World(port, flight, chosen), [], loop.time()
    print(HEAD, flush=True)
    try:
        end = began + chosen.hours * HOUR
        async with world.vehicle:
            while loop.time() < end and not task.done():
                await world.live(service, min(ROW_S, end - loop.time()))
                rows.append(measured(service, folder, began))
                print(rows[-1], flush=True)
        counters = service.snapshot().counters
        print(dict(world.happened), counters, sep="\n")
    finally:
        service.stop()
        await task
    return rows, world.happened["flight"] - counters.get("event_FlightEnded", 0)


def main() -> int:
    """Exit status 1 if something grows, or a flight was not heard."""
    parser = argparse.ArgumentParser(prog="benchmarks.soak", description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--flights", type=float, default=6.0, help="a day")
    parser.add_argument("--rate", type=float, default=2.0, help="samples/s of a standing vehicle")
    parser.add_argument("--incident-every", type=float, default=2.5, help="on average, min")
    chosen = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, fitted():
        flight = Path(folder) / "flight.tlog"
        in_a_process(record_landed, str(flight), FLIGHT_S, RATES).join()
        state = Path(folder) / "state"
        with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
            rows, missed = runner.run(soak(chosen, flight, state))
    print(f"{time.monotonic() - began:.0f} s")
    print(f"{missed} flights were not heard")
    return 1 if missed else judge(rows)


if __name__ == "__main__":
    sys.exit(main())
