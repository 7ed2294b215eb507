"""An independent MAVLink client (MAVSDK) takes the built-in autopilot for an ArduPilot."""

import asyncio
import contextlib
import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("mavsdk", reason="MAVSDK is an extra")

from sitl.builtin.autopilot import Autopilot
from sitl.builtin.server import Server
from sitl.builtin.truth import Truth
from sitl.errors import SitlError
from sitl.eyes import Eyes
from sitl.pilot import Pilot


@contextlib.asynccontextmanager
async def served(vehicle, speedup=20.0):
    server = Server(Autopilot(vehicle, Truth(seed=4)), speedup=speedup)
    port = await server.listen_tcp()
    task = asyncio.create_task(server.run())
    try:
        yield server, f"tcpout://127.0.0.1:{port}"
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["copter", "plane"])
async def test_mavsdk_reads_writes_and_flies(vehicle):
    async with served(vehicle) as (server, url), Pilot.at(url, vehicle) as pilot:
        await pilot.set_parameter("INS_ACCOFFS_X", 0.25)
        assert await pilot.parameter("INS_ACCOFFS_X") == 0.25
        assert await pilot.parameter("INS_ACCEL_FILTER") == 20.0
        with pytest.raises(SitlError, match="NO_SUCH_ONE"):
            await pilot.parameter("NO_SUCH_ONE")
        await pilot.take_off()
        assert pilot.height > 15.0
        before = pilot.time
        await pilot.wait(10.0)
        assert pilot.time - before >= 10.0
        await pilot.land()
        assert not pilot.armed
        assert np.allclose(server.autopilot.instant().velocity(), 0.0, atol=1.0)


class Passed:
    """What MAVSDK hands on: the vehicle's heartbeat, and the one of a companion behind it."""

    def __init__(self, heartbeats):
        self._heartbeats = heartbeats

    async def subscribe_message(self, name):
        for mode, autopilot in self._heartbeats if name == "HEARTBEAT" else ():
            fields = {"base_mode": mode, "autopilot": autopilot}
            yield SimpleNamespace(fields_json=json.dumps(fields))


async def test_a_companions_heartbeat_is_not_the_vehicles():
    eyes = Eyes(Passed([(128 + 81, 3), (0, 8)]))
    eyes.open()
    await asyncio.sleep(0.0)
    await asyncio.sleep(0.0)
    assert eyes.armed
    await eyes.close()


async def test_nobody_there_is_said():
    async with served("copter") as (_, url):
        await asyncio.sleep(0.1)  # it runs, and then nobody listens there any more
    with pytest.raises(SitlError, match=url):
        async with Pilot.at(url, "copter", patience=0.5):
            pass
