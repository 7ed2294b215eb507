from __future__ import annotations

import asyncio
import random
import struct
import threading

import pytest

from onboard.errors import ConfigurationError
from onboard.mavlink import connection as connection_module
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.limits import PENDING_LIMIT
from onboard.mavlink.link import Link
from onboard.mavlink.recorder import Recorder
from tests.mavlink.mavlink_peer import FakeAir, attitude, heartbeat, raw_imu


def frames(path):
    """(unix time, frame) of a .tlog, read by the format's definition."""
    data, out, at = path.read_bytes(), [], 0
    while at < len(data):
        (stamp,) = struct.unpack_from(">Q", data, at)
        length = data[at + 9] + 12
        out.append((stamp * 1e-6, data[at + 8 : at + 8 + length]))
        at += 8 + length
    return out


async def test_what_is_recorded_decodes_to_what_the_live_decoder_saw(tmp_path, monkeypatch):
    air = FakeAir()
    monkeypatch.setattr(connection_module, "open_transport", air.open)
    recorder = Recorder(tmp_path / "x.tlog")
    link = Link(
        [Endpoint.parse("udpin:127.0.0.1:14550"), Endpoint.parse("tcp:127.0.0.1:5760")],
        recorder=recorder,
        wall_clock=iter(range(1_700_000_000, 1_800_000_000)).__next__,
    )
    live, decoder = [], Decoder()
    link.subscribe(lambda now, message: live.extend(decoder.decode(message)), Decoder.names)
    task = asyncio.create_task(link.run())
    for _ in range(10):
        await asyncio.sleep(0)
    rng = random.Random(3)
    udp, tcp = air.transports
    udp.say(attitude(1))  # before the autopilot is known
    udp.say(heartbeat())
    tcp.say(heartbeat())
    for ms in range(1000, 3000, 20):
        for transport in (udp, tcp):
            transport.say(attitude(ms))
            transport.say(raw_imu(ms * 1000, tuple(rng.randrange(-2000, 2000) for _ in range(3))))
        udp.receive(rng.randbytes(5))
        udp.say(heartbeat(6, 8), Codec(system=255, component=190))
    link.close()
    await task
    recorded = frames(recorder.path)
    again, codec, decoder = [], Codec(), Decoder()
    for _, frame in recorded:
        for opened in codec.feed(frame):
            again.extend(decoder.decode(opened.message))
    assert len(live) >= 200
    assert again == live
    sources = {(f.system, f.component) for _, raw in recorded for f in Codec().feed(raw)}
    assert sources == {(1, 1), (1, 191), (255, 190)}
    stamps = [stamp for stamp, _ in recorded]
    assert stamps == sorted(stamps)


async def test_nothing_is_written_on_the_loops_thread(tmp_path):
    threads = set()

    class Watched(Recorder):
        def _append(self, block):
            threads.add(threading.get_ident())
            super()._append(block)

    recorder = Watched(tmp_path / "x.tlog")
    task = asyncio.create_task(recorder.run())
    await asyncio.sleep(0)
    frame = Codec(system=1, component=1).encode(heartbeat())
    for i in range(1000):
        recorder.write(i * 1e-3, frame)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert len(frames(recorder.path)) == recorder.frames == 1000
    assert threading.get_ident() not in threads


async def test_cancelled_in_the_middle_of_a_write_keeps_the_order(tmp_path, monkeypatch):
    monkeypatch.setattr("onboard.mavlink.limits.FLUSH_INTERVAL_S", 0.001)
    gate = threading.Event()
    writing = threading.Event()

    class Slow(Recorder):
        def _append(self, block):
            writing.set()
            assert gate.wait(20.0)
            super()._append(block)

    recorder = Slow(tmp_path / "x.tlog")
    codec = Codec(system=1, component=1)
    first, second = codec.encode(attitude(1)), codec.encode(attitude(2))
    recorder.write(1.0, first)
    task = asyncio.create_task(recorder.run())
    await asyncio.to_thread(writing.wait, 20.0)
    recorder.write(2.0, second)
    task.cancel()
    await asyncio.sleep(0.01)
    gate.set()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert [frame for _, frame in frames(recorder.path)] == [first, second]


async def test_a_full_disk_ends_the_recording_and_nothing_else(tmp_path, caplog):
    class Full(Recorder):
        def _append(self, block):
            raise OSError(28, "No space left on device")

    recorder = Full(tmp_path / "x.tlog")
    task = asyncio.create_task(recorder.run())
    await asyncio.sleep(0)
    recorder.write(1.0, b"frame")
    await recorder._flush()
    recorder.write(2.0, b"frame")
    assert recorder.dropped == 1
    assert "No space left" in caplog.text
    assert not task.done()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert len(caplog.records) == 1


async def test_a_disk_that_stands_still_costs_bounded_memory(tmp_path):
    recorder = Recorder(tmp_path / "x.tlog")
    block = bytes(1 << 20)
    for i in range(20):
        recorder.write(float(i), block)
    assert recorder.dropped > 0
    assert len(recorder._pending) <= PENDING_LIMIT + len(block) + 8
    recorder._file.close()


def test_a_file_that_cannot_be_made_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot record: No such file"):
        Recorder(tmp_path / "absent" / "x.tlog")
