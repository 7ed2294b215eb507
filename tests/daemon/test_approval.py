"""What is held back until a person says so, and what a person may say."""

import dataclasses

import aiohttp
import pytest

from onboard.errors import RefusedError
from tests.daemon.daemons import (
    WANTED,
    convinced,
    held_back,
    in_force,
    notices,
    push_done,
    pushed,
    until,
)
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def test_missing_physics_is_said_written_down_and_not_written(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        why = "the antenna is 0.6 m away and that is not told"
        convinced(service, WANTED, missing=why, effects=("gps_lever_arm",))
        await until(lambda: why in held_back(service).get("physics_missing", ""))
        snapshot = service.snapshot()
        assert snapshot.diagnosis["effects"][0]["name"] == "gps_lever_arm"
        assert [why in line.text for line in snapshot.journal if line.kind == "found"] == [True]
        await until(lambda: vehicle.heard.count("STATUSTEXT") > 0)
        told = [n.text for n in service.snapshot().notices if n.kind == "physics_missing"]
        assert told == ["physics missing: gps lever arm"]
        assert vehicle.sets == []


async def test_in_spite_of_a_diagnosis_a_person_approves_explicitly_or_not_at_all(
    document, daemon, port
):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, missing="the antenna is elsewhere", effects=("gps_lever_arm",))
        await until(lambda: "physics_missing" in held_back(service))
        for imus in ((), (1,)):
            with pytest.raises(RefusedError, match="--despite-diagnosis"):
                await service.approve(imus)
        with pytest.raises(RefusedError, match="by their number"):
            await service.approve((), despite_diagnosis=True)
        assert not service.snapshot().push.approval_needed
        assert vehicle.sets == []
        await service.approve((1,), despite_diagnosis=True)
        await until(lambda: pushed(vehicle))


async def test_an_approval_in_spite_of_one_diagnosis_is_none_in_spite_of_the_next(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED, missing="the antenna is elsewhere")
        await until(lambda: {"armed", "physics_missing"} <= held_back(service).keys())
        await service.approve((1,), despite_diagnosis=True)
        await until(lambda: held_back(service).keys() == {"armed"})
        convinced(service, WANTED, missing="the axes are not square")
        await until(lambda: "physics_missing" in held_back(service))
        assert vehicle.sets == []


async def test_approval_is_waited_for_and_asked_for_over_http(document, daemon, port):
    document["push"]["approval"] = True
    async with (
        daemon(document) as service,
        Vehicle(port) as vehicle,
        aiohttp.ClientSession(service.server.url) as client,
    ):
        async with client.post("/api/approve", json={}) as response:
            assert response.status == 409
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        assert vehicle.sets == []
        async with client.post("/api/approve", json={"imus": [1]}) as response:
            assert response.status == 200
        await until(lambda: pushed(vehicle))


async def test_an_approval_lapses_when_the_estimate_moves(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED)
        await until(lambda: {"armed", "approval"} <= held_back(service).keys())
        await service.approve(())
        await until(lambda: "approval" not in held_back(service))
        convinced(service, dataclasses.replace(WANTED, offset=(0.3, -0.1, 0.15)))
        await until(lambda: "approval" in held_back(service))
        assert vehicle.sets == []


async def test_nobody_is_asked_again_for_what_is_being_written(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        vehicle.denied.add("INS_ACCOFFS_Y")
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        await service.approve(())
        await until(lambda: "rolled back" in (service.snapshot().push.last_outcome or ""))
        assert service.snapshot().push.last_outcome.endswith("the autopilot keeps its old value")
        assert in_force(vehicle) == pytest.approx(before)
        # It is still approved, and is tried again by itself.
        await until(lambda: "failed_before" in held_back(service))
        assert "approval" not in held_back(service)
        vehicle.denied.clear()
        await until(lambda: pushed(vehicle))
        assert len(notices(service, "approval_needed")) == 1
        assert "approvals_lapsed" not in service.snapshot().counters


async def test_a_rejected_push_stays_rejected_until_approved(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        await service.reject((1,))
        await until(lambda: "refused" in held_back(service))
        assert vehicle.sets == []
        await service.approve((1,))
        await until(lambda: pushed(vehicle))


async def test_a_person_can_roll_back_and_it_is_not_pushed_again(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        with pytest.raises(RefusedError, match="no push"):
            await service.rollback(())
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert pushed(vehicle)
        await until(lambda: service.snapshot().link.armed is False)
        await service.rollback(())
        await until(lambda: "roll-back completed" in service.snapshot().push.last_outcome)
        assert in_force(vehicle) == before
        await until(lambda: "refused" in held_back(service))
        assert service.snapshot().push.can_roll_back == ()


@pytest.mark.parametrize("how", ["reject", "reset"])
async def test_who_rejects_in_the_middle_gets_all_old_ones_back(document, daemon, port, how):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        await service.approve(())
        await until(lambda: len(vehicle.sets) >= 2)
        assert in_force(vehicle) != pytest.approx(before)
        said = await getattr(service, how)(())
        assert how == "reset" or said == "IMU 1 rejected; what was written of it is undone"
        await until(lambda: "rolled back" in (service.snapshot().push.last_outcome or ""))
        assert in_force(vehicle) == pytest.approx(before)
        assert not service.snapshot().push.can_roll_back


async def test_a_way_back_is_not_rejected(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = await push_done(service, vehicle)
        await until(lambda: service.snapshot().link.armed is False)
        sets = len(vehicle.sets)
        await service.rollback(())
        await until(lambda: len(vehicle.sets) > sets)
        assert await service.reject((1,)) == "IMU 1 rejected"
        await until(lambda: "roll-back completed" in service.snapshot().push.last_outcome)
        assert in_force(vehicle) == pytest.approx(before)
