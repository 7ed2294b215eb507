"""Two services of one vehicle, each on a line of its own: the autopilot passes no HEARTBEAT on."""

from __future__ import annotations

import asyncio

import pytest

from onboard.mavlink.autopilot import TwinHeard
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.twins import PAYLOAD_TYPE, Twins, our_heartbeat, our_tunnel, signature_of
from tests.mavlink.running_link import TCP, beat, events, running
from tests.mavlink.virtual_time import virtual_time

OURS = Codec(system=1, component=191)


class Between:
    """What an autopilot passes from one of its lines to the other.

    As ArduPilot's MAVLink_routing does: what is addressed to all, but no HEARTBEAT to where one of
    that name has come from, and nothing that is for itself.
    """

    def __init__(self):
        self._heads = [0, 0]

    def pass_on(self, lines):
        for k, line in enumerate(lines):
            said, self._heads[k] = line.heard[self._heads[k] :], len(line.heard)
            for message in said:
                target = getattr(message, "target_system", 0)
                if message.get_type() != "HEARTBEAT" and target == 0:
                    lines[1 - k].say(message, OURS)


@virtual_time
@pytest.mark.parametrize("later", [0.0, 2.0, 60.0])
async def test_they_agree_on_which_of_them_writes(air, later):
    between = Between()
    async with running(TCP) as first:
        await beat(air.transports[0], later)
        async with running(TCP) as second:
            for _ in range(5):
                await asyncio.gather(*(beat(line, 1.0) for line in air.transports))
                between.pass_on(air.transports)
            now = asyncio.get_running_loop().time()
            assert first.twins.first(now) != second.twins.first(now)
            assert first.twins.first(now) or later < 3.0
            assert events(second, TwinHeard)
            assert first.twins.there(now)
            assert second.twins.there(now)


def test_tunnel_and_heartbeat_say_the_same():
    signature = Twins(lambda: 0.0, number=4095).signature(1e6)
    for message in (our_heartbeat(signature), our_tunnel(signature)):
        frame = Codec().feed(OURS.encode(message))[0]
        assert signature_of(frame.message) == signature


def test_the_tunnels_of_others_say_nothing():
    other = mavlink.MAVLink_tunnel_message(0, 0, PAYLOAD_TYPE + 1, 4, [7] * 128)
    assert signature_of(other) is None
    assert signature_of(mavlink.MAVLink_statustext_message(6, b"text")) is None


@virtual_time
async def test_what_a_router_gives_back_is_no_other_one(air):
    async with running() as link:
        (line,) = air.transports
        await beat(line, 5.0)
        for message in [m for m in line.heard if m.get_type() == "TUNNEL"]:
            line.say(message, OURS)
        await beat(line, 1.0)
        assert not events(link, TwinHeard)
        assert link.echoed >= 4
