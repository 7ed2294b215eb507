"""What was learned of an accelerometer before it died in flight is not written by itself."""

import asyncio

import pytest

from onboard.errors import RefusedError
from tests.daemon.daemons import WANTED, convinced, held_back, pushed, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time
DIED = {"start_s": 80.0, "end_s": 150.0, "reason": "imu_stuck", "why": "", "contradicted": None}
FIXES = {"start_s": 10.0, "end_s": 20.0, "reason": "gps_gap", "why": "", "contradicted": None}


async def test_it_waits_for_a_person_who_is_told_to_see_to_it(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, unused=[FIXES, DIED])
        await until(lambda: "imu_stuck" in held_back(service))
        assert "70 s" in held_back(service)["imu_stuck"]
        await asyncio.sleep(10.0)
        assert vehicle.sets == []
        step = service.snapshot().next_step
        assert (step.imu, step.severity) == (1, "error")
        assert "see to the accelerometer" in step.text
        with pytest.raises(RefusedError, match="despite-diagnosis"):
            await service.approve((1,))
        await service.approve((1,), despite_diagnosis=True)
        await until(lambda: pushed(vehicle))


async def test_fixes_that_were_not_used_are_no_reason(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, unused=[FIXES])
        await until(lambda: pushed(vehicle))
