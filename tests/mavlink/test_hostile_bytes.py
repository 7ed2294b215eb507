"""Bytes made to be slow to parse: the work is proportional to their number, and done in turns."""

from __future__ import annotations

import asyncio
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.mavlink import framing, limits
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.transport import open_transport
from tests.mavlink.mavlink_peer import attitude

UNKNOWN = b"\xfd\x09\x00\x00\x00\x00\x00\xee\xee\x7e"
"""Head of a packet whose message nobody knows: it is one only if no other begins inside it."""
KNOWN = b"\xfd\x20\x00\x00\x00\x00\x00\x1e\x00\x00"


class Counted:
    """How many bytes were summed for checksums."""

    def __init__(self, monkeypatch):
        self.bytes = 0
        honest = mavlink.x25crc

        def counted(data):
            self.bytes += len(data)
            return honest(data)

        monkeypatch.setattr(framing.mavlink, "x25crc", counted)


@pytest.mark.parametrize(
    "pattern",
    [
        b"\xfd",
        b"\xfe",
        b"\xfe\xff",
        b"\xfe\x1e",
        b"\xfd\xff\x00",
        UNKNOWN + KNOWN,
        b"\xfe\xfc\xfe\xff",  # an unknown message that is full of starts of a known one
        bytes((0xFD, 0xFF, 0, 0xFD, 0xFE, 0, 0xFD, 0x7F, 0)),
    ],
    ids=lambda pattern: pattern.hex(),
)
def test_a_start_is_summed_twice_at_the_most(monkeypatch, pattern):
    """Once where it is met, and once inside a packet of an unknown message."""
    data = (pattern * 40_000)[:40_000]
    counted = Counted(monkeypatch)
    codec = Codec()
    frames = codec.feed(data)
    starts = sum(pattern.count(magic) for magic in framing.MAGICS) / len(pattern) * len(data)
    assert counted.bytes <= 2 * 280 * starts
    taken = sum(len(frame.raw) for frame in frames)
    assert codec.statistics.bad_bytes + taken + len(codec._buffer) == len(data)


def test_ten_megabytes_of_magic_bytes_are_not_summed_at_all(monkeypatch):
    counted = Counted(monkeypatch)
    searched = 0
    find = framing.next_start

    def next_start(data, start):
        nonlocal searched
        at = find(data, start)
        searched += at - start + 1
        return at

    monkeypatch.setattr(framing, "next_start", next_start)
    codec = Codec()
    codec.feed(b"\xfd" * 10_000_000)
    assert counted.bytes == 0
    assert searched < 2 * 10_000_000
    assert len(codec._buffer) <= 280


@given(st.lists(st.sampled_from([b"\xfd", b"\xfe", UNKNOWN, KNOWN, b"\x00"]), max_size=60))
def test_frames_after_hostile_bytes_are_found(noise):
    frame = Codec(system=3, component=1).encode(attitude(5))
    frames = Codec().feed(b"".join(noise) + frame + bytes(600))
    assert frame in [found.raw for found in frames]


def test_senders_beyond_count_are_heard_but_not_counted_one_by_one():
    codec = Codec()
    frames = 0
    for system in range(1, 6):
        for component in range(1, 200):
            sender = Codec(system=system, component=component)
            frames += len(codec.feed(sender.encode(attitude(1))))
    assert frames == codec.statistics.frames == 5 * 199
    assert len(codec.statistics.sources) == limits.SOURCES_MAX


class Turns:
    """Sizes of what a transport handed on, and how often the loop had its turn in between."""

    def __init__(self):
        self.sizes = []
        self.loop_turns = []
        self.turn = 0

    def receive(self, data, _address=None):
        self.sizes.append(len(data))
        self.loop_turns.append(self.turn)

    def lost(self, reason):
        self.sizes.append(0)

    async def until(self, total):
        async with asyncio.timeout(20.0):
            while sum(self.sizes) < total:
                self.turn += 1
                await asyncio.sleep(0)


@pytest.mark.parametrize("linger", [0.0, 0.01])
async def test_one_datagram_however_long_is_taken_in_turns(linger):
    turns = Turns()
    transport = await open_transport(
        Endpoint.parse("udpin:127.0.0.1:0"), turns.receive, turns.lost, linger=linger
    )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        for _ in range(2):
            peer.sendto(b"\xfe" * 60_000, ("127.0.0.1", transport.port))
        await turns.until(120_000)
    transport.close()
    assert max(turns.sizes) <= limits.BYTES_PER_TURN
    assert len(set(turns.loop_turns)) == len(turns.sizes)


@pytest.mark.parametrize("linger", [0.0, 0.01])
async def test_a_flood_over_tcp_is_taken_in_turns(linger):
    turns = Turns()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        transport = await open_transport(
            Endpoint.parse(f"tcp:127.0.0.1:{port}"), turns.receive, turns.lost, linger=linger
        )
        peer, _ = server.accept()
        with peer:
            peer.settimeout(20.0)
            counting = asyncio.create_task(turns.until(50_000))
            await asyncio.to_thread(peer.sendall, b"\xfd" * 50_000)
            await counting
    transport.close()
    assert max(turns.sizes) <= limits.BYTES_PER_TURN
    assert len(set(turns.loop_turns)) == len(turns.sizes)
