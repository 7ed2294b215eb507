"""The daemon's parameters in ground stations of ours, over real sockets."""

import asyncio

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.outlets.parameter_view import STATES

pytestmark = pytest.mark.virtual_time
WANTED = (1.02, 0.99, 1.01, 0.2, -0.1, 0.15)


class Ground(asyncio.DatagramProtocol):
    """A ground station of a few lines."""

    def __init__(self, port, system=255):
        self.heard = []
        self._address = ("127.0.0.1", port)
        self._packer = mavlink.MAVLink(None, srcSystem=system, srcComponent=190)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self._news = asyncio.Event()
        self._transport = None

    async def __aenter__(self):
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(
            lambda: self, local_addr=("127.0.0.1", 0)
        )
        self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        return self

    async def __aexit__(self, *_):
        self._transport.close()

    def send(self, message):
        self._transport.sendto(message.pack(self._packer), self._address)

    def datagram_received(self, data, _address):
        self.heard += self._parser.parse_buffer(data) or ()
        self._news.set()

    @property
    def values(self):
        return {
            m.param_id: m.param_value
            for m in self.heard
            if m.get_type() == "PARAM_VALUE" and m.get_srcComponent() == 191
        }

    @property
    def texts(self):
        return [m.text for m in self.heard if m.get_type() == "STATUSTEXT"]

    def set(self, name, value):
        self.send(mavlink.MAVLink_param_set_message(1, 191, name.encode(), value, 9))

    async def until(self, condition):
        """Wait until it holds; the limit only ends a hopeless test."""
        async with asyncio.timeout(240.0):
            while not condition():
                self._news.clear()
                await self._news.wait()


def six(vehicle, imu=1):
    return [vehicle.parameters[name] for name in parameter_names(imu).six]


@pytest.mark.slow
async def test_two_ground_stations_see_the_same_and_one_approves(airfield):
    async with (
        airfield() as (_, vehicle, router),
        Ground(router.port) as one,
        Ground(router.port, 254) as other,
    ):
        for station in (one, other):
            station.send(mavlink.MAVLink_param_request_list_message(1, 191))
        for station in (one, other):
            await station.until(lambda s=station: len(s.values) == 55)
        assert one.values == other.values
        assert one.values["OBC_STATE"] == STATES["approval"]
        assert one.values["OBC_WAITING"] == 2.0
        await one.until(lambda: "OBC: calibration waits for OBC_APPROVE 1" in one.texts)
        assert one.values["OBC_1_SCAL_X"] == pytest.approx(1.02)
        assert not any(name.startswith("INS_") for name, _ in vehicle.sets)
        one.set("OBC_APPROVE", 1.0)
        # Acknowledged with 1; back at 0 when it is done; both stations hear of both.
        for station in (one, other):
            await station.until(
                lambda s=station: 1.0 in approvals(s) and s.values["OBC_APPROVE"] == 0.0
            )
            await station.until(lambda s=station: s.values["OBC_WAITING"] == 0.0)
        await one.until(lambda: six(vehicle) == pytest.approx(WANTED))
        await other.until(lambda: any("IMU 2 calibration written" in t for t in other.texts))
        # The autopilot's own change is seen by the same ground station.
        seen = {
            m.param_id: m.param_value
            for m in other.heard
            if m.get_type() == "PARAM_VALUE" and m.get_srcComponent() == 1
        }
        assert seen["INS_ACCSCAL_X"] == pytest.approx(1.02)


def approvals(station):
    return [
        m.param_value
        for m in station.heard
        if m.get_type() == "PARAM_VALUE" and m.param_id == "OBC_APPROVE"
    ]


@pytest.mark.slow
async def test_the_policy_is_set_and_told(airfield):
    async with airfield() as (service, _, router), Ground(router.port) as station:
        station.set("OBC_PUSH", 0.0)
        await station.until(lambda: station.values.get("OBC_PUSH") == 0.0)
        assert service.snapshot().push.policy == "never"
        await station.until(lambda: "OBC: push policy is now never" in station.texts)
        # What the policy holds back does not wait for a person alone.
        station.set("OBC_PUSH", 7.0)
        await station.until(lambda: any("OBC_PUSH" in text for text in station.texts))
        assert service.snapshot().push.policy == "never"
        assert station.values["OBC_PUSH"] == 0.0


async def test_approving_where_nobody_is_asked_is_refused_in_words(airfield):
    never = {"push": {"approval": False, "policy": "never", "disarmed_s": 2.0}}
    async with airfield(never) as (_, vehicle, router), Ground(router.port) as station:
        station.set("OBC_APPROVE", 1.0)
        await station.until(lambda: approvals(station))
        assert set(approvals(station)) == {0.0}
        await station.until(lambda: "OBC: OBC_APPROVE: nothing waits for approval" in station.texts)
        assert not any(name.startswith("INS_") for name, _ in vehicle.sets)


async def test_look_but_do_not_touch(airfield):
    async with (
        airfield({"parameters": {"writable": False}}) as (service, vehicle, router),
        Ground(router.port) as station,
    ):
        station.set("OBC_APPROVE", 1.0)
        station.set("OBC_PUSH", 2.0)
        await station.until(lambda: {"OBC_APPROVE", "OBC_PUSH"} <= station.values.keys())
        assert station.values["OBC_APPROVE"] == 0.0
        assert station.values["OBC_PUSH"] == 1.0
        assert service.snapshot().push.policy == "landed"
        assert not any(name.startswith("INS_") for name, _ in vehicle.sets)


async def test_switched_off_nobody_answers(airfield):
    off = {"parameters": {"enabled": False, "messages": False}}
    async with airfield(off) as (service, vehicle, router), Ground(router.port) as station:
        station.send(mavlink.MAVLink_param_request_list_message(1, 191))
        await service.approve(())
        await station.until(lambda: six(vehicle, 2)[0] == pytest.approx(1.02))
        assert station.values == {}
        assert station.texts == []
