"""What is left of the vehicle under a flood: samples heard, stalls of the loop, what is written.

An armed vehicle that stands (20 samples a second), or the simulated one in flight; the daemon,
which believes that it has learned something worth writing; and others who flood its port.
``python -m benchmarks.flood --seconds 10``.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import multiprocessing
import selectors
import socket
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any
from unittest.mock import patch

from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.link import Link
from onboard.mavlink.parameter_messages import to_float32

A_SECOND = 50_000
ASKED_A_SECOND = 3_000
RUBBISH_BYTES_S = 1.2e6
BURST = 0.002
QUIET_S = 5.0
LEARNED_S = 6.0


class WatchedSelector(selectors.DefaultSelector):
    """The longest turn of its loop, s: by the clock, and of the processor's time."""

    def __init__(self) -> None:
        super().__init__()
        self.worst = self.worst_cpu = 0.0
        self._began: tuple[float, float] | None = None

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait, as the base class does."""
        if self._began is not None:
            self.worst = max(self.worst, time.monotonic() - self._began[0])
            self.worst_cpu = max(self.worst_cpu, time.thread_time() - self._began[1])
        ready = super().select(timeout)
        self._began = time.monotonic(), time.thread_time()
        return ready


# The others, each in a process of its own


def stand(port: int) -> None:
    """An armed vehicle that says that it is in the air."""
    from tests.daemon.standing_vehicle import Vehicle

    async def forever() -> None:
        vehicle = Vehicle(port)
        vehicle.armed, vehicle.landed = True, False
        async with vehicle:
            await asyncio.sleep(3600.0)

    asyncio.run(forever())


def fly(port: int) -> None:
    """The simulated copter, armed and in the air."""
    from sitl.builtin.autopilot import Autopilot
    from sitl.builtin.server import Server
    from sitl.builtin.truth import Truth, random_imus

    def up(autopilot: Autopilot) -> None:
        autopilot.arm(force=True)
        autopilot.take_off(200.0)

    async def forever() -> None:
        autopilot = Autopilot("copter", Truth(imus=random_imus(3), seed=3))
        server = Server(autopilot)
        await server.connect_udp("127.0.0.1", port)
        server.request(up)
        await server.run()

    asyncio.run(forever())


def disarmed(port: int) -> None:
    """Disarmed HEARTBEATs and the old values, 50,000 a second, as 1/1 from one other port."""
    from tests.daemon.standing_vehicle import ardupilot_parameters

    codec = Codec(system=1, component=1)
    beat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)
    packets = [codec.encode(beat) for _ in range(244)]
    for name, value in ardupilot_parameters((1,)).items():
        if name.startswith("INS_ACC"):
            packets.append(codec.encode(
                mavlink.MAVLink_param_value_message(name.encode(), value, 9, 900, 65535)
            ))  # fmt: skip
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        paced(lambda n: sender.send(packets[n % len(packets)]), A_SECOND)


def rubbish(port: int) -> None:
    """1.2 MB/s of 0xFD in datagrams of 60 kB."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        paced(lambda _: sender.send(b"\xfd" * 60_000), RUBBISH_BYTES_S / 60_000)


def crowd(port: int) -> None:
    """40 ports that send a byte a second each."""
    senders = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(40)]
    paced(lambda n: senders[n % 40].sendto(b"x", ("127.0.0.1", port)), 40.0)


def many(port: int) -> None:
    """Disarmed HEARTBEATs, 50,000 a second, from 400 ports in turn."""
    senders = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(400)]
    beat = Codec(system=1, component=1).encode(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3))
    paced(lambda n: senders[n % 400].sendto(beat, ("127.0.0.1", port)), A_SECOND)


def asking(port: int) -> None:
    """Ground stations' requests, as many as a ration of bytes allows: reads and approvals."""
    codec = Codec(system=255, component=190)
    read = mavlink.MAVLink_param_request_read_message(1, 191, b"OBC_STATE", -1)
    approve = mavlink.MAVLink_param_set_message(1, 191, b"OBC_APPROVE", 1.0, 9)
    packets = [codec.encode(message) for message in (read, approve)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        paced(lambda n: sender.send(packets[n % 2]), ASKED_A_SECOND)


def paced(send: Callable[[int], object], rate: float) -> None:
    """Have it done so often a second, in bursts of some milliseconds; what fails is left."""
    began, sent = time.monotonic(), 0
    while True:
        due = int((time.monotonic() - began) * rate)
        for number in range(sent, due):
            try:
                send(number)
            except OSError:
                continue
        sent = due
        time.sleep(BURST)


def in_a_process(function: Callable[[int], None], port: int) -> SpawnProcess:
    """Start it."""
    process = multiprocessing.get_context("spawn").Process(
        target=function, args=(port,), daemon=True
    )
    process.start()
    return process


# The daemon


async def watched(
    attack: Callable[[int], None],
    vehicle: Callable[[int], None],
    seconds: float,
    selector: WatchedSelector,
    *,
    first: bool,
) -> dict[str, Any]:
    """One row: the attack begins before the vehicle (``first``), or when it has been adopted.

    Args:
        attack: to be run in a process of its own.
        vehicle: the same.
        seconds: how long to measure.
        selector: of the loop that this runs on.
        first: which of them begins.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        service = listening(port, Path(folder))
        others: list[SpawnProcess] = []
        with counted(service.link) as sent:
            task = asyncio.create_task(service.run())
            await service.ready.wait()
            try:
                if first:
                    others.append(in_a_process(attack, port))
                    await asyncio.sleep(2.0)
                began = time.monotonic()
                others.append(in_a_process(vehicle, port))
                await adopted(service)
                found = time.monotonic() - began
                quiet = await learned(service, standing=vehicle is stand)
                if not first:
                    others.append(in_a_process(attack, port))
                    await asyncio.sleep(2.0)
                row = await flooded(service, seconds, selector)
                return {
                    "found, s": f"{found:.1f}",
                    "RAW_IMU/s before": f"{quiet:.1f}",
                    **row,
                    "PARAM_SET": sent["PARAM_SET"],
                    "PARAM_VALUE": sent["PARAM_VALUE"],
                }
            finally:
                for other in others:
                    other.kill()
                service.stop()
                await task


def listening(port: int, folder: Path) -> Service:
    """The daemon, which is to listen to that port."""
    settings = {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"], "heartbeat_limit_s": 120.0},
        "push": {"disarmed_s": 2.0},
        "state": {"directory": str(folder / "state")},
        "http": {"port": 0},
    }
    return Service(from_mapping(settings, source="flood"))


@contextlib.contextmanager
def counted(link: Link) -> Iterator[Counter[str]]:
    """While this lasts, how many messages of each type are sent."""
    sent, send = Counter[str](), link.send

    def counting(message: Message) -> None:
        sent[message.get_type()] += 1
        send(message)

    with patch.object(link, "send", counting):
        yield sent


async def adopted(service: Service) -> None:
    """Until the vehicle has been found."""
    async with asyncio.timeout(60.0):
        while not service.link.presence.proven:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def learned(service: Service, *, standing: bool) -> float:
    """RAW_IMU a second without a flood, when it believes that it knows something worth writing."""
    from tests.daemon.daemons import calibration, convinced

    offset = tuple(to_float32(0.05 + 0.01 * i) for i in range(3))
    if standing:
        convinced(service, calibration(in_force_offset=offset))
    await asyncio.sleep(LEARNED_S)
    return await rate(heard(service), QUIET_S)


async def flooded(service: Service, seconds: float, selector: WatchedSelector) -> dict[str, Any]:
    """What is measured under attack."""
    selector.worst = selector.worst_cpu = 0.0
    used = time.process_time()
    samples = await rate(heard(service), seconds)
    used = (time.process_time() - used) / seconds
    armed = service.parts.observed.condition(time.monotonic()).armed
    return {
        "under attack": f"{samples:.1f}",
        "worst turn, ms": f"{1e3 * selector.worst:.0f}",
        "of processor": f"{1e3 * selector.worst_cpu:.0f}",
        "core": f"{used:.2f}",
        "believed armed": armed,
    }


def heard(service: Service) -> dict[str, int]:
    """Messages that came, by type."""
    return service.parts.traffic._counts  # noqa: SLF001


async def rate(counts: dict[str, int], seconds: float) -> float:
    """RAW_IMU a second over the next seconds."""
    before, began = counts.get("RAW_IMU", 0), time.monotonic()
    await asyncio.sleep(seconds)
    return (counts.get("RAW_IMU", 0) - before) / (time.monotonic() - began)


ROWS: dict[str, tuple[Callable[[int], None], Callable[[int], None], bool]] = {
    "50,000/s disarmed, standing": (disarmed, stand, False),
    "50,000/s disarmed, simulated copter": (disarmed, fly, False),
    "50,000/s disarmed, first": (disarmed, stand, True),
    "50,000/s from 400 ports": (many, stand, False),
    "3,000/s requests of a ground station, standing": (asking, stand, False),
    "1.2 MB/s of 0xFD, standing": (rubbish, stand, False),
    "1.2 MB/s of 0xFD, first": (rubbish, stand, True),
    "40 ports with a byte a second, first": (crowd, stand, True),
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.flood", description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--only", nargs="*", default=[], help="words of the rows that are wanted")
    chosen = parser.parse_args()
    for name, (attack, vehicle, first) in ROWS.items():
        if chosen.only and not any(word in name for word in chosen.only):
            continue
        selector = WatchedSelector()
        with asyncio.Runner(loop_factory=partial(asyncio.SelectorEventLoop, selector)) as runner:
            row = runner.run(watched(attack, vehicle, chosen.seconds, selector, first=first))
        print(name, row, flush=True)


if __name__ == "__main__":
    main()
