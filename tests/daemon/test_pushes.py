"""What the daemon writes over real UDP to a vehicle that stands still, and what it does not."""

import asyncio
import shutil
from pathlib import Path

import pytest

from onboard.core.estimate.result import Status
from onboard.core.maths.accelerometer import parameter_names
from tests.daemon.daemons import (
    SIX,
    WANTED,
    calibration,
    convinced,
    held_back,
    in_force,
    made,
    pushed,
    until,
)
from tests.daemon.standing_vehicle import PX4, Vehicle

pytestmark = pytest.mark.virtual_time


async def test_a_confident_answer_is_pushed_when_landed_and_read_back(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed, vehicle.landed = True, False
        convinced(service, WANTED)
        await until(lambda: "armed" in held_back(service))
        assert vehicle.sets == []
        vehicle.armed, vehicle.landed = False, True
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert "push completed" in service.snapshot().push.last_outcome
        assert pushed(vehicle)
        assert service.snapshot().push.can_roll_back == (1,)
        assert {name for name, _ in vehicle.sets} == set(SIX)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"status": Status.COLLECTING}, "not_calibrated"),
        ({"parameters_known": False}, "parameters_unknown"),
        ({"scale": (1.3, 1.0, 1.0)}, "out_of_bounds"),
        ({"predictive_gain": 1.0}, "no_improvement"),
    ],
)
async def test_what_is_not_good_enough_is_shown_but_never_written(
    document, daemon, port, change, reason
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, calibration(**change))
        await until(lambda: reason in held_back(service))
        await until(lambda: vehicle.heard.count("PARAM_REQUEST_READ") > 20)
        assert vehicle.sets == []


async def test_what_nobody_has_diagnosed_is_not_written(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        await until(lambda: service.handover.identified)
        convinced(service, WANTED)
        service.handover._learner._flight = None
        await until(lambda: "not_diagnosed" in held_back(service))
        vehicle.armed = False
        await until(lambda: held_back(service).keys() == {"not_diagnosed"})
        assert vehicle.sets == []


async def test_policy_never_only_advises(document, daemon, port):
    document["push"]["policy"] = "never"
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: "policy_never" in held_back(service))
        assert vehicle.sets == []


async def test_an_autopilot_that_is_not_ardupilot_is_advised_and_never_written(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port, firmware=PX4) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().mode == "advise_only")
        await until(lambda: vehicle.heard.count("HEARTBEAT") >= 2)
        snapshot = service.snapshot()
        assert "px4, not ArduPilot" in snapshot.mode_reason
        assert any(notice.kind == "advise_only" for notice in snapshot.notices)
        assert "PARAM_SET" not in vehicle.heard


async def test_only_the_chosen_accelerometers_are_written(document, daemon, port):
    document["push"]["imus"] = [2]
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, calibration(2))
        await until(lambda: service.snapshot().push.can_roll_back == (2,))
        assert {name for name, _ in vehicle.sets} == set(parameter_names(2).six)


async def test_a_ground_station_that_writes_in_the_middle_aborts_the_push(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = vehicle.parameters["INS_ACCOFFS_Y"]
        convinced(service, WANTED)
        await until(lambda: len(vehicle.sets) >= 6)
        vehicle.set_by_other("INS_ACCOFFS_Y", 1.25)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert "rolled back" in service.snapshot().push.last_outcome
        assert vehicle.parameters["INS_ACCOFFS_Y"] == 1.25 != before
        assert vehicle.parameters["INS_ACCOFFS_X"] == pytest.approx(0.05)
        assert vehicle.parameters["INS_ACCSCAL_X"] == 1.0


async def test_a_denied_write_leaves_everything_as_it_was_and_is_not_hammered(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        vehicle.denied.add("INS_ACCSCAL_Z")
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert in_force(vehicle) == before
        await until(lambda: "failed_before" in held_back(service))
        assert service.snapshot().counters["pushes"] == 1


async def test_a_crash_in_the_middle_of_a_push_is_put_right_after_the_restart(
    document, daemon, port
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        vehicle.mute_after_sets = 3
        service = made(document)
        task = asyncio.create_task(service.run())
        convinced(service, WANTED)
        await until(lambda: len(vehicle.sets) == 3)
        task.cancel()  # no stages: as if killed
        await asyncio.gather(task, return_exceptions=True)
        assert in_force(vehicle) != before
        assert not pushed(vehicle)
        vehicle.mute_after_sets = None
        async with daemon(document) as again:
            await until(lambda: again.snapshot().push.last_outcome is not None)
            assert again.snapshot().counters["resumed"] == 1
            assert in_force(vehicle) == before
            journal = again.snapshot().journal
            kinds = [line.kind for line in journal if line.kind != "found"]
            assert kinds[0] == "planned"
            assert kinds[-1] == "closed"


async def test_a_flight_that_was_worse_takes_the_push_back(document, daemon, port, monkeypatch):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        flown = calibration(
            scale=(1.0, 1.0, 1.0),
            offset=(0.05, 0.06, 0.07),
            in_force_scale=tuple(in_force(vehicle)[:3]),
            in_force_offset=tuple(in_force(vehicle)[3:]),
            held_out_before=9.0,
        )
        monkeypatch.setattr("onboard.daemon.learning.proof.answers", lambda _: {1: flown})
        vehicle.armed, vehicle.landed = True, False
        await until(lambda: service.snapshot().link.armed)
        vehicle.armed, vehicle.landed = False, True
        await until(lambda: service.snapshot().push.can_roll_back == ())
        assert in_force(vehicle) == before
        kinds = [notice.kind for notice in service.snapshot().notices]
        assert "push_worse" in kinds
        judged = service.snapshot().push.judged[0]
        assert (judged.verdict, judged.held_out_before_push) == ("worse", 4.0)
        assert judged.held_out_after_push == 9.0
        await until(lambda: "refused" in held_back(service))


@pytest.mark.parametrize("set_to", [0.0, 4_000_000_000.0])
async def test_a_clock_that_is_set_in_the_middle_of_a_push_changes_nothing(
    document, daemon, port, monkeypatch, set_to
):
    """As on a computer without a battery for its clock, when it first hears of the time."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        taken = vehicle._set

        def set_and_jump(message):
            taken(message)
            if len(vehicle.sets) == 3:
                monkeypatch.setattr("tests.daemon.daemons.EPOCH", set_to)

        vehicle._set = set_and_jump
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert service.snapshot().time == pytest.approx(set_to, abs=1000.0)
        assert pushed(vehicle)
        assert len(vehicle.sets) == 6
    async with daemon(document) as service, Vehicle(port, parameters=vehicle.parameters):
        await until(lambda: service.parts.parameters.complete)
        assert service.snapshot().push.can_roll_back == (1,)
        assert service.parts.journal.damaged == 0


def put_elsewhere(directory, place):
    shutil.copytree(directory, place)
    shutil.rmtree(directory)
    directory.symlink_to(place)


async def test_a_state_directory_that_is_put_elsewhere_meanwhile_stops_pushes_until_a_restart(
    document, daemon, port, tmp_path
):
    """What the next start would not know of is not begun, and nothing of the vehicle is changed."""
    directory = Path(document["state"]["directory"])
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.handover.identified)
        before = in_force(vehicle)
        put_elsewhere(directory, tmp_path / "elsewhere")
        convinced(service, WANTED)
        await until(lambda: service.snapshot().counters.get("journal_failed", 0) > 0)
        await asyncio.sleep(1.0)
        assert vehicle.sets == []
        assert in_force(vehicle) == before
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert pushed(vehicle)
