"""What the whole daemon costs: CPU and memory on a live stream, and over a simulated day.

The load is the heaviest that it is made for: RAW_IMU at 200 Hz, ATTITUDE at 50 Hz, GPS at 10 Hz and
the status messages, from a flight of the simulated autopilot, each message in its own datagram as
it falls due.  The day is flight after flight, each landed, diagnosed and followed by half a minute
on the ground.  ``python -m benchmarks.daemon --live S --day H`` chooses how long.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import os
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from onboard.mavlink import framing
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import Message, mavlink

RATES = {"RAW_IMU": 200.0, "ATTITUDE": 50.0, "GPS_RAW_INT": 10.0}
LIVE_S = 90.0
WARM_UP_S = 20.0
LANDING_S = 40.0
"""Of a simulated flight: what is measured live ends before; what a landing costs is the day's."""
DAY_H = 1.0
FLIGHT_S = 300.0
"""From one flight to the next."""
GROUND_S, STANDING_S = 10.0, 30.0
"""Before the launch, and at the least after the landing."""
TICKS = os.sysconf("SC_CLK_TCK")
PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 2**20
EXECUTE = "from onboard.cli.main import main; main()"


def record(path: str, seconds: float, rates: dict[str, float]) -> None:
    """In a process of its own, for a simulator takes memory: a flight as a .tlog."""
    from sitl.recording import FlightSpec, write_tlog

    write_tlog(FlightSpec(vehicle="plane", duration=seconds, rates=rates), path)


def record_landed(path: str, seconds: float, rates: dict[str, float]) -> None:
    """The same with some time on the ground before and after the flight."""
    from pymavlink.dialects.v20 import ardupilotmega as mav

    from sitl.builtin.autopilot import Autopilot as Simulated
    from sitl.builtin.messages import packed
    from sitl.builtin.truth import Truth, random_imus
    from sitl.recording import DEFAULT_RATES

    autopilot = Simulated("plane", Truth(imus=random_imus(3), seed=3), loop_rate=400)
    link = autopilot.connect()
    for name, rate in {**DEFAULT_RATES, **rates}.items():
        autopilot.links.set_rate(link, name, rate)
    autopilot.links.request_parameters(link)
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    with Path(path).open("wb") as file:
        while autopilot.clock < seconds:
            if not autopilot.armed and GROUND_S <= autopilot.clock < GROUND_S + 1.0:
                autopilot.arm(force=True)
                autopilot.take_off(seconds - GROUND_S - STANDING_S)
            autopilot.advance(1.0)
            file.writelines(
                round(t * 1e6).to_bytes(8, "big") + packed(message, packer)
                for t, message in link.outbox
            )
            link.outbox.clear()


def frames(path: Path) -> Iterator[tuple[float, bytes]]:
    """(seconds from the start, frame) of a .tlog."""
    first = None
    with path.open("rb") as file:
        while head := file.read(10):
            stamp = int.from_bytes(head[:8], "big")
            signature = 13 if (flags := file.read(1))[0] & 1 else 0
            rest = file.read(head[9] + 9 + signature)
            first = stamp if first is None else first
            yield 1e-6 * (stamp - first), head[8:] + flags + rest


def answers(packer: mavlink.MAVLink, data: bytes) -> Iterator[bytes]:
    """What an autopilot says to this: any rate is granted, every parameter has a value."""
    for frame in Codec().feed(data):
        question = frame.message
        if frame.message_id == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
            accepted = mavlink.MAV_RESULT_ACCEPTED
            yield mavlink.MAVLink_command_ack_message(question.command, accepted).pack(packer)
        elif frame.message_id == mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ:
            name = question.param_id
            value = 1.0 if "ACCSCAL" in name else 0.0
            kind = mavlink.MAV_PARAM_TYPE_REAL32
            told = mavlink.MAVLink_param_value_message(name.encode(), value, kind, 1000, 0)
            yield told.pack(packer)


def play(port: int, path: str, speed: float) -> None:
    """In a process of its own: the flight, so many times as fast, a datagram per message."""
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        began = time.monotonic()
        for t, frame in frames(Path(path)):
            wait = began + t / speed - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            sender.send(frame)
            with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
                while question := sender.recv(2048, socket.MSG_DONTWAIT):
                    packer.seq = frame[4]
                    for answer in answers(packer, question):
                        sender.send(answer)


def in_a_process(function: Callable[..., None], *arguments: object) -> SpawnProcess:
    """Start it; the caller joins or kills."""
    process = multiprocessing.get_context("spawn").Process(target=function, args=arguments)
    process.start()
    return process


def cpu_and_memory(pid: int) -> tuple[float, float]:
    """CPU seconds used so far and resident memory (MB) of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return (int(fields[11]) + int(fields[12])) / TICKS, pages * PAGE_MB


def live(seconds: float, speed: float = 1.0) -> tuple[float, float, dict[str, Any]]:
    """CPU share and memory (MB) of ``onboard run`` under the load, after warming up; its snapshot.

    ``speed``: times as fast as it was flown, which is as many times the messages.
    """
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe,
        socket.create_server(("127.0.0.1", 0)) as page,
    ):
        probe.bind(("127.0.0.1", 0))
        port, page_port = probe.getsockname()[1], page.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "daemon.toml"
        config.write_text(
            f'[link]\nendpoints = ["udpin:127.0.0.1:{port}"]\nheartbeat_limit_s = 120\n'
            f'[state]\ndirectory = "{folder}/state"\n[http]\nport = {page_port}\n'
        )
        daemon = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-c", EXECUTE, "run", "--config", str(config)],
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )
        flight = str(Path(folder) / "flight.tlog")
        in_a_process(record, flight, speed * (seconds + WARM_UP_S) + LANDING_S, RATES).join()
        autopilot = in_a_process(play, port, flight, speed)
        try:
            for line in daemon.stderr or ():
                if "ardupilot" in line:
                    break
            time.sleep(WARM_UP_S)
            began, (before, _) = time.monotonic(), cpu_and_memory(daemon.pid)
            time.sleep(seconds)
            after, memory = cpu_and_memory(daemon.pid)
            share = (after - before) / (time.monotonic() - began)
            with urllib.request.urlopen(f"http://127.0.0.1:{page_port}/api/snapshot") as answer:
                snapshot = json.load(answer)
        finally:
            autopilot.kill()
            daemon.terminate()
            daemon.communicate()
            autopilot.join()
    return share, memory, snapshot


def later(frame: bytes, seconds: float) -> bytes:
    """The frame with its stamp moved on the boot clock."""
    kind = mavlink.mavlink_map[framing.message_id(frame, 0)]
    letters = kind.native_format.decode()[1:]
    for name, unit in (("time_usec", 1e-6), ("time_boot_ms", 1e-3)):
        if name in kind.ordered_fieldnames:
            place = kind.ordered_fieldnames.index(name)
            form = "<" + letters[place]
            at, body = 10 + struct.calcsize("<" + letters[:place]), bytearray(frame[:-2])
            body = body.ljust(at + struct.calcsize(form), b"\0")  # zeros at its end were left out
            (stamp,) = struct.unpack_from(form, body, at)
            stamp = (stamp + round(seconds / unit)) % (1 << 8 * struct.calcsize(form))
            struct.pack_into(form, body, at, stamp)
            body[1] = len(body) - 10
            summed = bytes(body[1:]) + bytes((kind.crc_extra,))
            return bytes(body) + framing.checksum(summed).to_bytes(2, "little")
    return frame


@dataclass(frozen=True, slots=True)
class Day:
    """What the day cost: CPU as a share of a core, of it in diagnoses; memory in MB.

    ``early`` and ``late`` are memory at the end of the flight that ends the first fifth, and of the
    last; ``peak`` is the most that there ever was, ``diagnosis_s`` CPU seconds of one diagnosis.
    """

    share: float
    diagnoses: int
    diagnosis_s: float
    early: float
    late: float
    peak: float


def heard(service: Service, now: float, message: Message) -> None:
    """What a link does with a message before it hands it on: who is there, what time it is."""
    link = service.link
    for event in link.presence.hear((1, 1), (0, ("", 0)), message, None, now).events:
        service.contact.on_link_event(now, event)
    link.boot_clock.observe(message)


async def day(hours: float) -> Day:
    """The same flight again and again on one boot clock, in this process, without a link."""
    now, began = 0.0, time.perf_counter()

    def clock() -> float:
        """Simulated time, on which the solver's own duration shows, as on a real clock."""
        return now + time.perf_counter() - began

    with tempfile.TemporaryDirectory() as folder:
        document = {"state": {"directory": folder}, "http": {"enabled": False}}
        service = Service(from_mapping(document, source="benchmark"), clock=clock)
        beat = mavlink.MAVLink_heartbeat_message(1, 3, 0, 0, 3, 3)
        heard(service, now, beat)  # before its parameters come
        flight = Path(folder) / "flight.tlog"
        in_a_process(record_landed, str(flight), FLIGHT_S, RATES).join()
        flights = max(5, round(hours * 3600.0 / FLIGHT_S))
        early = diagnosing = 0.0
        diagnoses = 0
        used = time.process_time()
        for number in range(flights):
            next_tick = number * FLIGHT_S
            codec = Codec()
            for t, raw in frames(flight):
                now = number * FLIGHT_S + t
                for frame in codec.feed(later(raw, number * FLIGHT_S)):
                    if frame.message is not None:
                        heard(service, now, frame.message)
                        service.on_message(now, frame.message)
                if now >= next_tick:
                    next_tick += 1.0
                    before = time.process_time()
                    await service.handover.step()
                    if service.snapshot().counters.get("diagnoses", 0) > diagnoses:
                        diagnoses += 1
                        diagnosing += time.process_time() - before
                    await service.on_tick(now)
            if number == flights // 5:
                early = cpu_and_memory(os.getpid())[1]
        share = (time.process_time() - used) / (flights * FLIGHT_S)
        late = cpu_and_memory(os.getpid())[1]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return Day(share, diagnoses, diagnosing / max(1, diagnoses), early, late, peak)


def simulated_day(hours: float) -> Day:
    """:func:`day`, for a process of its own: its memory is to be the daemon's alone."""
    return asyncio.run(day(hours))


def run(live_s: float = LIVE_S, day_h: float = DAY_H) -> list[tuple[str, float, str]]:
    """The figures, as (name, value, unit)."""
    share, memory, _ = live(live_s)
    out = [
        ("daemon: live at 200 + 50 + 10 Hz", 100.0 * share, "% of a core"),
        ("daemon: memory, live", memory, "MB"),
    ]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        cost = fresh.submit(simulated_day, day_h).result()
    out += [
        (f"daemon: {day_h:g} h, flights diagnosed", float(cost.diagnoses), ""),
        ("daemon: all of it", 100.0 * cost.share, "% of a core"),
        ("daemon: a flight's diagnosis with its refinement", cost.diagnosis_s, "s"),
        ("daemon: memory after a fifth of that", cost.early, "MB"),
        ("daemon: memory after all of it", cost.late, "MB"),
        ("daemon: memory at its highest, in a diagnosis", cost.peak, "MB"),
    ]
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--live", type=float, default=LIVE_S, metavar="S", help="seconds live")
    parser.add_argument("--day", type=float, default=DAY_H, metavar="H", help="simulated hours")
    parser.add_argument("--speed", type=float, help="live alone, so many times as fast")
    chosen = parser.parse_args()
    if chosen.speed is not None:
        used, resident, told = live(chosen.live, chosen.speed)
        print(f"{100.0 * used:.1f} % of a core, {resident:.1f} MB")
        print(told["link"]["counters"], told["counters"], told["trust"], sep="\n")
        sys.exit()
    for name, value, unit in run(chosen.live, chosen.day):
        print(f"{name:48} {value:8.2f} {unit}")
