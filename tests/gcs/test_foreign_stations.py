"""The daemon's parameters in ground stations of others: MAVSDK, MAVProxy."""

import asyncio
import contextlib
import os
import re
import shutil

import pytest

from tests.gcs.test_ground_stations import WANTED, six

LOOSENED = {"push": {"approval": True, "disarmed_s": 2.0, "allow_loosening": True}}
"""Where a ground station may choose any policy."""


@pytest.mark.slow
async def test_mavsdk_reads_lists_and_sets(airfield):
    mavsdk = pytest.importorskip("mavsdk.asyncio", reason="mavsdk is not installed")
    from mavsdk.asyncio.plugins.param import (  # noqa: PLC0415
        ParamAsync,
        ParamError,
        ParamResult,
        ProtocolVersion,
    )

    async with airfield(LOOSENED) as (service, vehicle, router):
        kind = mavsdk.ComponentType.GROUND_STATION
        station = mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(kind))
        try:
            await station.add_any_connection(f"udpout://127.0.0.1:{router.port}")
            parameters = ParamAsync(await station.first_autopilot(30.0))
            with contextlib.suppress(ParamError):  # it answers UNKNOWN, and selects
                await parameters.select_component(191, ProtocolVersion.V1)
            everything = await parameters.get_all_params()
            floats = {p.name: p.value for p in everything.float_params}
            assert len(floats) == 55
            assert floats["OBC_2_OFFS_X"] == pytest.approx(0.1)
            await parameters.set_param_float("OBC_PUSH", 2.0)
            assert service.snapshot().push.policy == "in_flight"
            assert await parameters.get_param_float("OBC_PUSH") == 2.0
            for name, value, reason in (
                ("OBC_STATE", 1.0, ParamResult.READ_ONLY),
                ("OBC_PUSH", 9.0, ParamResult.VALUE_OUT_OF_RANGE),
            ):
                with pytest.raises(ParamError) as denied:
                    await parameters.set_param_float(name, value)
                assert denied.value.result == reason
            await parameters.set_param_float("OBC_APPROVE", 1.0)
            async with asyncio.timeout(60.0):
                while six(vehicle, 2)[0] != pytest.approx(1.02):
                    await asyncio.sleep(0.02)
                while await parameters.get_param_float("OBC_APPROVE") != 0.0:
                    await asyncio.sleep(0.02)
        finally:
            await asyncio.to_thread(station.destroy)


MAVPROXY = os.environ.get("MAVPROXY") or shutil.which("mavproxy.py")


@pytest.mark.skipif(
    MAVPROXY is None, reason="MAVProxy is not installed (pip install MAVProxy), nor MAVPROXY set"
)
async def test_mavproxy_fetches_shows_and_sets(airfield, tmp_path):
    async with airfield(LOOSENED) as (service, vehicle, router):
        console = await asyncio.create_subprocess_exec(
            MAVPROXY,
            f"--master=udpout:127.0.0.1:{router.port}",
            "--default-modules=param,link",
            f"--state-basedir={tmp_path}",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            cwd=tmp_path,
        )
        said = bytearray()
        news = asyncio.Event()

        async def listen():
            while chunk := await console.stdout.read(4096):
                said.extend(chunk)
                news.set()

        async def say(line, pattern):
            """Type a command until the answer appears: the console may be busy starting."""
            start = len(said)
            async with asyncio.timeout(120.0):
                while not (found := re.search(pattern, said[start:].decode(errors="replace"))):
                    console.stdin.write(f"{line}\n".encode())
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(3.0):
                            while not re.search(pattern, said[start:].decode(errors="replace")):
                                news.clear()
                                await news.wait()
            return found

        listener = asyncio.create_task(listen())
        try:
            await say("", r"Detected vehicle 1:191")
            await say("vehicle 1:191", r"Set vehicle 1:191")
            await say("param fetch", r"Received 55 parameters|Requested parameter list")
            await say("param show OBC_*", r"OBC_1_SCAL_X\s+1\.0[12]")
            await say("param set OBC_PUSH 2", r"push policy is now in flight")
            assert service.snapshot().push.policy == "in_flight"
            await say("param show OBC_PUSH", r"OBC_PUSH\s+2\.0")
            await say("param set OBC_STATE 9", r"Failed to set OBC_STATE|read-only")
            await say("param set OBC_APPROVE 1", r"IMU 2 calibration written")
            assert six(vehicle) == pytest.approx(WANTED)
        finally:
            console.kill()
            await console.wait()
            await asyncio.gather(listener, return_exceptions=True)
