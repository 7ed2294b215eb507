"""The page in front of the real service and the built-in autopilot: seen, approved, written."""

import asyncio
import socket
from contextlib import asynccontextmanager

import numpy as np
import pytest

from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.process.service import Service
from onboard.daemon.setup.configuration import from_mapping
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.mission import Mission
from sitl.builtin.server import Server
from sitl.builtin.truth import ImuTruth, Truth
from tests.daemon.daemons import until
from tests.daemon.flights import level_error

TRUTH = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))


@asynccontextmanager
async def serving(tmp_path):
    """A service that asks a person first, before a copter that flies once."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    document = {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"], "heartbeat_limit_s": 30.0},
        "push": {
            "approval": True,
            "disarmed_s": 2.0,
            # A short flight cannot show everything as well as the default policy wants it.
        },
        "state": {"directory": str(tmp_path / "state")},
        "http": {"port": 0},
    }
    service = Service(from_mapping(document, source="test"))
    autopilot = Autopilot("copter", Truth(imus=(TRUTH,), seed=5))
    mission = Mission(flights=1, duration=120.0, ground=20.0)
    server = Server(autopilot, speedup=8.0, driver=mission)
    serving = asyncio.create_task(service.run())
    async with asyncio.timeout(60.0):
        await service.ready.wait()
    await server.connect_udp("127.0.0.1", port)
    flying = asyncio.create_task(server.run())
    try:
        yield service, autopilot, mission
    finally:
        service.stop()
        await serving
        flying.cancel()
        await asyncio.gather(flying, return_exceptions=True)


def six(autopilot):
    return np.array([autopilot.parameters[name] for name in parameter_names(1).six])


@pytest.mark.slow
async def test_what_is_approved_on_the_page_is_written_to_the_autopilot(
    browser, tmp_path, monkeypatch
):
    monkeypatch.setattr("onboard.daemon.process.limits.TICK_S", 0.1)

    def see(condition):
        return asyncio.to_thread(browser.until, condition)

    async with serving(tmp_path) as (service, autopilot, mission):
        await asyncio.to_thread(browser.open, service.server.url)
        await see(lambda: browser.text("#glance-trust .headline") == "Trusted")
        await see(lambda: browser.elements("#axes canvas"))
        await until(lambda: mission.flown == 1 and not autopilot.flying)
        # On the ground there is nothing to hurry for, and much to learn from what was flown.
        autopilot.parameters.load({"SIM_SPEEDUP": 1.0})
        await see(lambda: browser.text("#glance-imu-1 .headline") == "Waits for your approval")
        before = six(autopilot)
        assert list(before[:3]) == [1.0, 1.0, 1.0]

        def approve():
            browser.until(
                lambda: browser.run(CLICK, '.proposal[data-imu="1"] [data-action="approve"]')
            )
            browser.element("#confirm-yes").click()
            browser.until_says("#push-result", "IMU 1 approved")
            browser.until(lambda: browser.elements('[data-key="rollback-1"]'))

        await asyncio.to_thread(approve)
        error_before = np.abs(before - (*TRUTH.scale, *TRUTH.offset))
        error_after = np.abs(six(autopilot) - (*TRUTH.scale, *TRUTH.offset))
        assert np.all(error_after[:3] < 0.01)
        assert np.all(error_after[3:5] < 0.05)
        # z scale and offset of a short flight are known better together than each by itself.
        assert abs(level_error(six(autopilot), (*TRUTH.scale, *TRUTH.offset))) < 0.05
        assert np.all(error_after < error_before)
        await see(lambda: "INS_ACCSCAL_X: 1 -> " in browser.text("#journal-lines"))

        def roll_back():
            browser.until(lambda: browser.run(CLICK, '[data-key="rollback-1"]'))
            browser.element("#confirm-yes").click()
            browser.until(lambda: not browser.elements('[data-key="rollback-1"]'))

        await asyncio.to_thread(roll_back)
        assert six(autopilot) == pytest.approx(before)
        assert browser.complaints() == []
        browser.blank()  # before the service goes, which it would complain of


APPROVE = '.proposal[data-imu="1"] [data-action="approve"]'
# A table that is renewed while it is looked for must not lose the click.
CLICK = """const e = document.querySelector(arguments[0]); e?.click();
return document.querySelector('#confirm').open;"""
