"""What the way from bytes to samples costs: per message, and of a core on a live UDP link.

The load is the heaviest that the daemon is made for: RAW_IMU at 200 Hz, ATTITUDE at 50 Hz,
GPS_RAW_INT at 10 Hz, each in its own datagram as it falls due.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import socket
import tempfile
import time
from pathlib import Path

from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import Message, mavlink, message_ids
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.limits import LINGER_S
from onboard.mavlink.link import Link
from onboard.mavlink.recorder import Recorder

RATES = {"RAW_IMU": 200, "ATTITUDE": 50, "GPS_RAW_INT": 10, "HEARTBEAT": 1}
LIVE_S = 10.0


def message(name: str, t: float) -> Message:
    """One message of the load at boot time ``t`` (s)."""
    ms, us = round(t * 1e3), round(t * 1e6)
    if name == "RAW_IMU":
        return mavlink.MAVLink_raw_imu_message(us, 12, -34, -1003, 5, -6, 7, 100, 200, 300, 0, 2503)
    if name == "ATTITUDE":
        return mavlink.MAVLink_attitude_message(ms, 0.1, 0.2, 0.3, 0.01, 0.02, 0.03)
    if name == "GPS_RAW_INT":
        return mavlink.MAVLink_gps_raw_int_message(
            us, 3, -353632610, 1491652299, 584090, 80, 90, 1234, 5678, 17, 0, 900, 1200, 250
        )
    return mavlink.MAVLink_heartbeat_message(2, 3, 0x80, 0, 4, 3)


def load(seconds: float) -> list[tuple[float, bytes]]:
    """(time, frame) of the load, in order."""
    due = sorted(
        (i / rate, name) for name, rate in RATES.items() for i in range(round(seconds * rate))
    )
    codec = Codec(system=1, component=1)
    return [(t, codec.encode(message(name, 100.0 + t))) for t, name in due]


def fly(port: int, seconds: float) -> None:
    """The autopilot's process: send the load in real time."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.connect(("127.0.0.1", port))
        start = time.monotonic()
        for t, frame in load(seconds):
            time.sleep(max(0.0, start + t - time.monotonic()))
            sock.send(frame)


async def live(seconds: float, linger: float, recording: Path | None) -> tuple[float, int]:
    """CPU share of this process on a live link, and the samples that came of it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    decoder = Decoder()
    samples = 0

    def take(_: float, received: Message) -> None:
        nonlocal samples
        samples += len(decoder.decode(received))

    recorder = Recorder(recording) if recording is not None else None
    link = Link([Endpoint.parse(f"udpin:127.0.0.1:{port}")], linger=linger, recorder=recorder)
    link.subscribe(take, Decoder.names)
    task = asyncio.create_task(link.run())
    await asyncio.sleep(0.1)
    autopilot = multiprocessing.get_context("spawn").Process(target=fly, args=(port, seconds + 2))
    autopilot.start()
    await link.wait_autopilot(30.0)
    began, cpu = time.monotonic(), time.process_time()
    await asyncio.sleep(seconds)
    share = (time.process_time() - cpu) / (time.monotonic() - began)
    link.close()
    await task
    autopilot.kill()
    autopilot.join()
    return share, samples


def per_message(*, wanted: bool) -> float:
    """Seconds per message from bytes to samples (or to being skipped)."""
    wire = b"".join(frame for _, frame in load(100.0))
    count = 100 * sum(RATES.values())
    codec = Codec(wanted=message_ids(Decoder.names) if wanted else frozenset())
    decoder = Decoder(1, 1)
    began = time.perf_counter()
    for at in range(0, len(wire), 150):
        for frame in codec.feed(wire[at : at + 150]):
            if frame.message is not None:
                decoder.decode(frame.message)
    return (time.perf_counter() - began) / count


def run() -> list[tuple[str, float, str]]:
    """The figures, as (name, value, unit)."""
    out = [
        ("link: bytes to sample", 1e6 * min(per_message(wanted=True) for _ in range(3)), "us"),
        ("link: message skipped", 1e6 * min(per_message(wanted=False) for _ in range(3)), "us"),
    ]
    with tempfile.TemporaryDirectory() as folder:
        share, _ = asyncio.run(live(LIVE_S, LINGER_S, Path(folder) / "x.tlog"))
    out.append(("link: live at 261 messages/s, recording", 100.0 * share, "% of a core"))
    share, _ = asyncio.run(live(LIVE_S, 0.0, None))
    out.append(("link: the same, waking up for each datagram", 100.0 * share, "% of a core"))
    return out


if __name__ == "__main__":
    for name, value, unit in run():
        print(f"{name:48} {value:8.2f} {unit}")
