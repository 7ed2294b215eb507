"""The link in virtual time, its sockets replaced: the autopilot, traffic, participants."""

from __future__ import annotations

import asyncio

import pytest

from onboard.errors import LinkError
from onboard.mavlink.autopilot import (
    AutopilotFound,
    AutopilotRebooted,
    AutopilotReturned,
    AutopilotSilent,
    AutopilotState,
)
from onboard.mavlink.codec import Codec
from onboard.mavlink.connection import (
    ConnectionState,
)
from onboard.mavlink.dialect import mavlink
from onboard.mavlink.limits import (
    HEARTBEAT_TIMEOUT_S,
)
from onboard.mavlink.link import Link
from onboard.mavlink.streams import StreamRequest, Streams
from tests.mavlink.mavlink_peer import attitude, heartbeat, raw_imu
from tests.mavlink.running_link import TCP, UDP, beat, events, running
from tests.mavlink.virtual_time import virtual_time


class TestAutopilot:
    @virtual_time
    async def test_it_is_found_and_we_take_its_system_id(self, air):
        async with running() as link:
            transport = air.transports[0]
            transport.say(heartbeat(6, 8), Codec(system=255, component=190))
            assert link.autopilot is None
            transport.say(heartbeat(1, 3), Codec(system=42, component=1))
            found = await link.wait_autopilot(1.0)
            assert (found.system, found.component, found.vehicle) == (42, 1, "plane")
            assert found.is_ardupilot
            await asyncio.sleep(1.5)
            ours = transport.heard[-1]
            assert (ours.get_srcSystem(), ours.get_srcComponent()) == (42, 191)
            assert events(link, AutopilotFound) == [AutopilotFound(found)]

    @virtual_time
    async def test_another_firmware_is_not_ardupilot(self, air):
        async with running() as link:
            air.transports[0].say(heartbeat(2, 12))
            found = await link.wait_autopilot(1.0)
            assert not found.is_ardupilot
            assert found.firmware_name == "px4"

    @virtual_time
    async def test_only_the_system_asked_for_counts(self, air):
        async with running(system=7) as link:
            air.transports[0].say(heartbeat(), Codec(system=1, component=1))
            assert link.autopilot is None
            air.transports[0].say(heartbeat(), Codec(system=7, component=1))
            assert link.autopilot.system == 7

    @virtual_time
    async def test_our_heartbeat_goes_out_once_a_second_from_the_start(self, air):
        async with running():
            await asyncio.sleep(10.05)
            heard = [m for m in air.transports[0].heard if m.get_type() == "HEARTBEAT"]
            assert 10 <= len(heard) <= 12
            assert {m.type for m in heard} == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
            assert {m.autopilot for m in heard} == {mavlink.MAV_AUTOPILOT_INVALID}

    @virtual_time
    async def test_no_heartbeat_in_time_names_every_endpoint(self, air):
        air.failures = [ConnectionRefusedError(111, "Connection refused") for _ in range(99)]
        async with running(TCP) as link:
            with pytest.raises(LinkError, match="in 5 s") as caught:
                await link.wait_autopilot(5.0)
            assert f"{TCP} (Connection refused)" in str(caught.value)
            assert caught.value.exit_status == 3

    @virtual_time
    async def test_silence_and_return_are_told(self, air):
        async with running() as link:
            await beat(air.transports[0], 3)
            await asyncio.sleep(HEARTBEAT_TIMEOUT_S + 1.0)
            assert link.state is AutopilotState.SILENT
            (silent,) = events(link, AutopilotSilent)
            assert silent.silence == pytest.approx(HEARTBEAT_TIMEOUT_S, abs=0.3)
            await beat(air.transports[0], 1)
            assert link.state is AutopilotState.PRESENT
            assert events(link, AutopilotReturned) == [AutopilotReturned()]

    @virtual_time
    async def test_a_reboot_is_told_once(self, air):
        async with running() as link:
            transport = air.transports[0]
            transport.say(heartbeat())
            for ms in (60_000, 60_020, 1000, 1020, 1040):
                transport.say(attitude(ms))
                transport.say(raw_imu(ms * 1000))
            assert events(link, AutopilotRebooted) == [AutopilotRebooted(1)]


class TestTraffic:
    @virtual_time
    async def test_of_two_ways_to_one_autopilot_one_is_used_and_the_other_takes_over(self, air):
        async with running(UDP, TCP) as link:
            heard = []
            link.subscribe(lambda now, m: heard.append(m.time_boot_ms), ["ATTITUDE"])
            udp, tcp = air.transports
            for ms in range(10_000, 12_000, 100):
                for transport in (udp, tcp):
                    transport.say(heartbeat())
                    transport.say(attitude(ms))
                await asyncio.sleep(0.1)
            assert heard == list(range(10_000, 12_000, 100))
            assert link.presence.standby == 40
            for ms in range(12_000, 16_000, 100):
                tcp.say(attitude(ms))
                await asyncio.sleep(0.1)
            assert heard[-1] == 15_900
            assert len(heard) == len(set(heard))
            assert heard.index(heard[20]) == 20
            assert heard[20] <= 12_000 + 1700

    @virtual_time
    async def test_answers_go_where_the_target_was_heard_and_the_rest_everywhere(self, air):
        async with running(UDP, TCP) as link:
            udp, tcp = air.transports
            udp.say(heartbeat())
            tcp.say(heartbeat(6, 8), Codec(system=255, component=190))
            link.send(mavlink.MAVLink_param_request_read_message(1, 1, b"X", -1))
            link.send(mavlink.MAVLink_param_value_message(b"OBC_STATE", 1.0, 9, 1, 0))
            link.send(mavlink.MAVLink_command_ack_message(1, 0, 0, 0, 255, 190))
            ours = {"HEARTBEAT", "TUNNEL"}
            kinds = [
                [m.get_type() for m in t.heard if m.get_type() not in ours] for t in (udp, tcp)
            ]
            assert kinds == [["PARAM_REQUEST_READ", "PARAM_VALUE"], ["PARAM_VALUE", "COMMAND_ACK"]]

    @virtual_time
    async def test_our_own_messages_come_back_by_a_router_are_not_taken_for_anything(self, air):
        async with running() as link:
            heard = []
            link.subscribe(lambda now, message: heard.append(message), ["HEARTBEAT"])
            air.transports[0].say(heartbeat())
            air.transports[0].say(heartbeat(18, 8), Codec(system=1, component=191))
            assert len(heard) == 1
            assert link.echoed == 1

    @virtual_time
    async def test_handlers_get_messages_in_order_with_their_receive_times(self, air):
        async with running() as link:
            out = []
            link.subscribe(lambda now, m: out.append((round(now, 3), m.time_boot_ms)), ["ATTITUDE"])
            start = asyncio.get_running_loop().time()
            for i in range(3):
                air.transports[0].say(attitude(i))
                await asyncio.sleep(0.5)
            assert out == [(round(start + 0.5 * i, 3), i) for i in range(3)]

    @virtual_time
    async def test_a_handler_that_fails_ends_the_link_with_its_error(self, air):
        loop = asyncio.get_running_loop()
        link = Link([UDP], clock=loop.time)

        def fail(now, message):
            raise RuntimeError("the estimator broke")

        link.subscribe(fail, ["ATTITUDE"])
        task = asyncio.create_task(link.run())
        await asyncio.sleep(0.1)
        air.transports[0].say(attitude(1))
        with pytest.raises(RuntimeError, match="the estimator broke"):
            await task
        assert air.transports[0].closed

    @virtual_time
    async def test_cancelling_lets_go_of_everything(self, air):
        link = Link([UDP, TCP], clock=asyncio.get_running_loop().time)
        task = asyncio.create_task(link.run())
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert all(transport.closed for transport in air.transports)
        assert {c.state for c in link.connections} == {ConnectionState.CLOSED}

    @virtual_time
    async def test_a_link_closed_before_it_ran_ends_at_once(self, air):
        link = Link([UDP], clock=asyncio.get_running_loop().time)
        link.close()
        await link.run()


class TestParticipants:
    @virtual_time
    async def test_they_are_driven_and_after_a_reboot_restarted(self, air):
        streams = Streams([StreamRequest("ATTITUDE", 50.0)])
        asked = []

        def autopilot(message):
            if message.get_type() == "COMMAND_LONG":
                asked.append(message.param1)
                yield mavlink.MAVLink_command_ack_message(message.command, 0, 0, 0, 1, 191)

        async with running() as link:
            link.attach(streams)
            transport = air.transports[0]
            transport.answer = autopilot
            await asyncio.sleep(5.0)
            assert asked == []
            await beat(transport, 3, attitude(50_000))
            assert asked == [30.0]
            assert streams.report()[0].granted == 50.0
            transport.say(attitude(10))
            transport.say(attitude(30))
            await beat(transport, 3)
            assert asked == [30.0, 30.0]
