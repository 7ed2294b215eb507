"""The link's connections in virtual time: pace, retries, silence; its sockets are replaced."""

from __future__ import annotations

import asyncio
import random
from itertools import pairwise

import pytest

from onboard.errors import UnavailableError
from onboard.mavlink.connection import (
    TRANSITIONS,
    Backoff,
    ConnectionState,
)
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.endpoint import EndpointError
from onboard.mavlink.limits import (
    ASKING_S,
    BACKOFF_BASE_S,
    BACKOFF_CAP_S,
    LINGER_S,
    REST_TICK_S,
    SILENCE_S,
    STABLE_S,
)
from onboard.mavlink.link import Link
from tests.mavlink.mavlink_peer import attitude, heartbeat
from tests.mavlink.running_link import TCP, UDP, beat, running
from tests.mavlink.virtual_time import virtual_time


class TestPace:
    """How long a message may wait for the sake of fewer wake-ups."""

    @virtual_time
    async def test_what_has_come_is_read_before_anything_is_said(self, air):
        async with running(UDP):
            (transport,) = air.transports
            reads = []
            write = transport.write
            transport.write = lambda data, to=(): (reads.append(transport.reads), write(data, to))
            transport.say(heartbeat())
            await asyncio.sleep(10.0)
            firsts = reads[::2]  # a HEARTBEAT and a TUNNEL at a time
            assert len(firsts) >= 9
            assert all(after > before for before, after in pairwise(firsts))

    @virtual_time
    async def test_answers_are_not_left_lying(self, air):
        async with running(UDP) as link:
            (transport,) = air.transports
            await beat(transport, 5.0)
            assert transport.lingers[-1] > REST_TICK_S  # the tick reads sooner
            for message, brief in (
                (mavlink.MAVLink_statustext_message(6, b"to whom it may concern"), False),
                (mavlink.MAVLink_param_request_read_message(1, 1, b"INS_ACCSCAL_X", -1), True),
            ):
                link.send(message)
                assert (transport.lingers[-1] == LINGER_S) == brief
            await beat(transport, ASKING_S + 1.0)
            assert transport.lingers[-1] > REST_TICK_S

    @virtual_time
    async def test_nor_is_anything_while_a_push_is_under_way(self, air):
        async with running(UDP) as link:
            (transport,) = air.transports
            link.presence.held = lambda: True
            await beat(transport, 5.0)
            assert transport.lingers[-1] == LINGER_S


class TestConnection:
    @virtual_time
    async def test_refused_connections_are_tried_again_with_growing_jittered_waits(self, air):
        air.failures = [ConnectionRefusedError(111, "Connection refused") for _ in range(60)]
        async with running(TCP) as link:
            await asyncio.sleep(800.0)
            assert link.connections[0].connects >= 1
            waits = [b - a for a, b in pairwise(air.opened_at[:61])]
            assert all(wait <= BACKOFF_CAP_S + 1e-6 for wait in waits)
            assert waits[0] <= 0.5 + 1e-6
            assert max(waits) > 5.0

    @virtual_time
    async def test_after_a_connection_that_lasted_the_waits_begin_anew(self, air):
        refused = ConnectionRefusedError(111, "Connection refused")
        for lasted, most in ((STABLE_S + 1.0, BACKOFF_BASE_S), (0.1, BACKOFF_CAP_S)):
            waits = []
            for seed in range(20):
                air.failures, air.transports[:], air.opened_at[:] = [refused] * 10, [], []
                loop = asyncio.get_running_loop()
                async with running(TCP, rng=random.Random(seed)):
                    while not air.transports:
                        await asyncio.sleep(0.1)
                    await asyncio.sleep(lasted)
                    air.transports[0].lost("gone")
                    lost_at, tries = loop.time(), len(air.opened_at)
                    while len(air.opened_at) == tries:
                        await asyncio.sleep(0.01)
                    waits.append(air.opened_at[-1] - lost_at)
            assert max(waits) <= most
            assert max(waits) > 0.5 * most

    @virtual_time
    async def test_a_broken_connection_comes_back_and_hears_again(self, air):
        async with running(TCP) as link:
            heard = []
            link.subscribe(lambda now, message: heard.append(message), ["ATTITUDE"])
            await beat(air.transports[0], 3)
            air.transports[0].lost("closed by the other side")
            await asyncio.sleep(1.0)
            first, second = air.transports
            assert first.closed
            await beat(second, 1, attitude(5000))
            assert len(heard) == 1
            assert link.connections[0].connects == 2
            assert link.connections[0].last_error == "closed by the other side"

    @virtual_time
    async def test_what_was_refused_or_not_sent_is_counted_beyond_a_reconnection(self, air):
        async with running(UDP) as link:
            connection = link.connections[0]
            air.transports[0].refused, air.transports[0].dropped = 5, 3
            connection.peers.refused = 2
            assert (connection.refused, connection.dropped) == (7, 3)
            air.failures = [ConnectionRefusedError(111, "Connection refused")] * 20
            air.transports[0].lost("gone")
            await asyncio.sleep(0.01)
            assert (connection.refused, connection.dropped) == (7, 3)
            connection.write(b"to nobody")
            assert connection.dropped == 4
            air.failures = []
            await asyncio.sleep(2.0 * BACKOFF_CAP_S)
            air.transports[1].refused = air.transports[1].dropped = 1
            assert connection.refused == 8
            assert connection.dropped >= 5  # and our own HEARTBEATs meanwhile

    @virtual_time
    async def test_a_line_gone_dead_is_opened_anew_but_udp_is_left_alone(self, air):
        async with running(TCP, UDP):
            await asyncio.sleep(SILENCE_S + 5.0)
            assert [t.endpoint for t in air.transports] == [TCP, UDP, TCP]

    @virtual_time
    @pytest.mark.parametrize("kind", [EndpointError, UnavailableError])
    async def test_what_cannot_be_opened_at_all_ends_the_link(self, air, kind):
        air.failures = [kind(f"{UDP}: no port for us")]
        link = Link([UDP], clock=asyncio.get_running_loop().time)
        with pytest.raises(kind, match="no port for us"):
            await link.run()

    @virtual_time
    @pytest.mark.parametrize("kind", [EndpointError, UnavailableError])
    async def test_once_up_even_that_is_tried_again(self, air, kind):
        async with running(TCP) as link:
            air.failures = [kind("no permission while udev sets the device up")]
            air.transports[0].lost("unplugged")
            await asyncio.sleep(20.0)
            assert link.connections[0].is_up

    @virtual_time
    async def test_every_state_is_left_only_by_the_table(self, air):
        states = []
        async with running(TCP) as link:
            states.append(link.connections[0].state)
            link.subscribe_events(
                lambda now, event: states.append(event.state) if hasattr(event, "state") else None
            )
            for _ in range(3):
                air.transports[-1].lost("again")
                await asyncio.sleep(30.0)
        assert states[-1] is ConnectionState.CLOSED
        for a, b in pairwise(states):
            assert b in TRANSITIONS[a]

    def test_backoff_is_full_jitter(self):
        backoff = Backoff(random.Random(2))
        for attempt in range(50):
            assert 0.0 <= backoff.next() <= min(15.0, 0.5 * 2.0**attempt)
        backoff.reset()
        assert backoff.next() <= 0.5
