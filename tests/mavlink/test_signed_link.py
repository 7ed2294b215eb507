"""Signing on a link: what is acted on is signed, new, and of the endpoint in use."""

from __future__ import annotations

import asyncio
import random
from contextlib import asynccontextmanager

import pytest

from onboard.mavlink import connection as connection_module
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.link import Link
from onboard.mavlink.signing import EPOCH_UNIX_S, TICKS_PER_S, Signing
from tests.mavlink.mavlink_peer import FakeAir, attitude, heartbeat
from tests.mavlink.running_link import under_way
from tests.mavlink.virtual_time import virtual_time

KEY = bytes(range(32))
UDP = Endpoint.parse("udpin:127.0.0.1:14550")
TCP = Endpoint.parse("tcp:127.0.0.1:5760")
DAY = 86_400.0
NOW = EPOCH_UNIX_S + 3e8


@pytest.fixture
def air(monkeypatch):
    air = FakeAir()
    monkeypatch.setattr(connection_module, "open_transport", air.open)
    return air


class SignedVehicle:
    """Its clock is ``ahead`` of ours, s."""

    def __init__(self, ahead=0.0, link_id=0):
        loop = asyncio.get_running_loop()
        self.signing = Signing(KEY, lambda: NOW + loop.time() + ahead)
        self.codec = Codec(system=1, component=1, signing=self.signing, link_id=link_id)

    def says(self, message):
        return self.codec.encode(message)


@asynccontextmanager
async def running(*endpoints, ahead=0.0, record=None):
    """A link that demands signatures; its wall clock may be off."""
    loop = asyncio.get_running_loop()

    def wall():
        return NOW + loop.time() + ahead

    signing = Signing(KEY, wall, record=record)
    link = Link(endpoints, clock=loop.time, wall_clock=wall, rng=random.Random(1), signing=signing)
    link.heard = []
    link.signing = signing
    link.subscribe(lambda now, m: link.heard.append(m.time_boot_ms), ["ATTITUDE"])
    async with under_way(link):
        yield link


def unknown(system=1, component=1):
    """An unsigned frame whose message nobody knows: its checksum cannot be computed."""
    number = next(n for n in range(60_000, 70_000) if n not in mavlink.mavlink_map)
    head = bytes((4, 0, 0, 9, system, component)) + number.to_bytes(3, "little")
    return b"\xfd" + head + b"abcd" + b"\x12\x34"


@pytest.mark.parametrize("standby", ["unknown", "radio", "unsigned", "replayed"])
@virtual_time
async def test_nothing_but_a_new_signed_message_makes_an_endpoint_the_one_in_use(air, standby):
    async with running(UDP, TCP) as link:
        udp, tcp = air.transports
        vehicle = SignedVehicle()
        beat = vehicle.says(heartbeat())
        udp.receive(beat, udp.address)
        for ms in range(10_000, 12_000, 100):
            udp.receive(vehicle.says(attitude(ms)), udp.address)
            await asyncio.sleep(0.1)
        way = link.presence.way
        await asyncio.sleep(1.7)
        false = {
            "unknown": unknown(),
            "radio": Codec(system=1, component=1).encode(
                mavlink.MAVLink_radio_status_message(1, 1, 1, 1, 1, 1, 1)
            ),
            "unsigned": Codec(system=1, component=1).encode(heartbeat()),
            "replayed": beat,
        }[standby]
        tcp.receive(false)
        assert link.presence.way == way
        udp.receive(vehicle.says(attitude(13_700)), udp.address)
        assert link.heard[-1] == 13_700


@virtual_time
async def test_a_copy_that_comes_first_on_the_other_endpoint_takes_nothing_away(air):
    """A router that gives both the same packets, the one that stands by a little earlier."""
    async with running(UDP, TCP) as link:
        udp, tcp = air.transports
        vehicle = SignedVehicle()
        udp.receive(vehicle.says(heartbeat()), udp.address)
        for ms in range(10_000, 20_000, 100):
            if ms % 1000 == 0:
                beat = vehicle.says(heartbeat())
                tcp.receive(beat)
                udp.receive(beat, udp.address)
            frame = vehicle.says(attitude(ms))
            tcp.receive(frame)
            udp.receive(frame, udp.address)
            udp.receive(frame, udp.address)
            await asyncio.sleep(0.1)
        assert link.heard == list(range(10_000, 20_000, 100))
        for ms in range(20_000, 24_000, 100):  # and takes over where the other one ends
            tcp.receive(vehicle.says(attitude(ms)))
            await asyncio.sleep(0.1)
        assert link.heard[-1] == 23_900
        assert len(link.heard) == len(set(link.heard))


@pytest.mark.parametrize("ahead", [0.0, -DAY, 120.0, -NOW])
@virtual_time
async def test_after_a_restart_nothing_old_is_believed_whatever_the_clock_says(air, ahead):
    loop = asyncio.get_running_loop()
    vehicle = SignedVehicle()
    async with running(UDP) as link:
        transport = air.transports[0]
        old = [vehicle.says(heartbeat())] + [vehicle.says(attitude(ms)) for ms in (1, 2, 3)]
        for frame in old:
            transport.receive(frame, transport.address)
        sent = link.signing.next_timestamp()
        record = link.signing.kept()
    await asyncio.sleep(5.0)
    async with running(UDP, ahead=ahead, record=record) as link:
        transport = air.transports[-1]
        for frame in old:
            transport.receive(frame, transport.address)
        assert link.heard == []
        assert link.autopilot is None
        assert link.signing.next_timestamp() > sent
        transport.receive(vehicle.says(heartbeat()), transport.address)
        transport.receive(vehicle.says(attitude(7000)), transport.address)
        assert link.heard == [7000]
        assert loop.time() < 10.0


@virtual_time
async def test_after_a_crash_nothing_is_believed_that_came_after_the_last_record(air):
    vehicle = SignedVehicle()
    async with running(UDP) as link:
        transport = air.transports[0]
        transport.receive(vehicle.says(heartbeat()), transport.address)
        record = link.signing.kept(margin_s=10.0)
        await asyncio.sleep(9.0)
        late = vehicle.says(attitude(1))
        transport.receive(late, transport.address)
        sent = link.signing.next_timestamp()
    async with running(UDP, record=record) as link:
        transport = air.transports[-1]
        transport.receive(late, transport.address)
        assert link.heard == []
        assert link.signing.next_timestamp() > sent
        await asyncio.sleep(2.0)
        transport.receive(vehicle.says(attitude(3000)), transport.address)
        assert link.heard == [3000]


@virtual_time
async def test_a_clock_that_is_ahead_is_told_until_the_vehicle_has_taken_it_over(air):
    """First start of all: only our own clock says what is old, and it is wrong."""
    async with running(UDP, ahead=120.0) as link:
        transport = air.transports[0]
        vehicle = SignedVehicle()
        transport.answer = None
        transport.receive(vehicle.says(heartbeat()), transport.address)
        assert link.autopilot is None
        assert link.signing.behind_s == pytest.approx(120.0, abs=2.0)
        # Our own HEARTBEAT goes to it all the same, and is newer than all that it knows.
        ours = link.signing.next_timestamp()
        vehicle.signing._timestamp = ours
        transport.receive(vehicle.says(heartbeat()), transport.address)
        assert link.autopilot is not None
        assert link.signing.behind_s == 0.0


@virtual_time
async def test_who_is_refused_for_its_clock_is_answered(air):
    """Or its clock could never be put right."""
    async with running(UDP, ahead=120.0) as link:
        transport = air.transports[0]
        transport.receive(SignedVehicle().says(heartbeat()), transport.address)
        assert list(link.connections[0].peers.answered(asyncio.get_running_loop().time())) == [
            transport.address
        ]


@virtual_time
async def test_a_clock_that_is_behind_follows_the_vehicles(air):
    async with running(UDP, ahead=-DAY) as link:
        transport = air.transports[0]
        transport.receive(SignedVehicle().says(heartbeat()), transport.address)
        assert link.autopilot is not None
        assert link.signing.ahead_s == pytest.approx(DAY, abs=2.0)
        now = (NOW - EPOCH_UNIX_S) * TICKS_PER_S
        assert link.signing.next_timestamp() > now


@virtual_time
async def test_no_time_at_all_still_gives_stamps_that_grow(air):
    """A computer without a clock, at 1970: every stamp is greater than that before."""
    signing = Signing(KEY, lambda: 0.0)
    assert (signing.behind_s, signing.ahead_s) == (0.0, 0.0)  # nothing was heard, nothing is told
    first = [signing.next_timestamp() for _ in range(3)]
    again = Signing(KEY, lambda: 0.0, record=signing.kept(margin_s=10.0))
    assert first == sorted(set(first))
    assert again.next_timestamp() > first[-1]
