"""What was learned belongs to a board and to values in force: no other gets it unasked.

Device identifiers are no help: they are the same on every board of one model.
"""

import asyncio

import pytest

from onboard.push.entries import Planned
from tests.daemon.daemons import (
    calibration,
    convinced,
    held_back,
    in_force,
    notices,
    push_done,
    ticks,
    until,
)
from tests.daemon.standing_vehicle import Vehicle, ardupilot_parameters

pytestmark = pytest.mark.virtual_time
WANTED = calibration()
ANOTHER = "0d0e0f"


async def learned_but_not_written(service, vehicle):
    """A flight has taught everything; the power goes before it could be written."""
    vehicle.armed = True
    convinced(service, WANTED)
    await until(lambda: held_back(service).keys() == {"armed"})
    vehicle.armed = False


async def settled(service, number=20):
    await until(lambda: service.handover.identified and service.parts.parameters.complete)
    await ticks(service, number)


def becomes(vehicle, board, **parameters):
    """Another board of the same model is in its place: other values, the same identifiers."""
    vehicle.board = board
    vehicle.parameters = ardupilot_parameters() | parameters


async def test_another_board_does_not_get_it_after_a_restart(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            await learned_but_not_written(service, vehicle)
        becomes(vehicle, ANOTHER, INS_ACCOFFS_X=-0.5)
        async with daemon(document) as again:
            await settled(again)
            assert vehicle.sets == []
            assert again.snapshot().push.proposals == ()


async def test_another_board_does_not_get_it_while_the_daemon_is_on(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await learned_but_not_written(service, vehicle)
        becomes(vehicle, ANOTHER)
        vehicle.reboot()
        await until(lambda: service.counters["autopilot_rebooted"] == 1)
        await settled(service)
        assert vehicle.sets == []
        assert service.snapshot().push.proposals == ()
        (text,) = notices(service, "another_board")
        assert "another board answers as system 1" in text


@pytest.mark.parametrize("how", ["restart", "reboot"])
async def test_a_board_that_does_not_say_which_it_is_waits_for_a_flight(
    document, daemon, port, how
):
    async with Vehicle(port) as vehicle:
        vehicle.board = ""
        async with daemon(document) as service:
            await learned_but_not_written(service, vehicle)
            if how == "reboot":
                vehicle.reboot()
                await until(lambda: service.counters["autopilot_rebooted"] == 1)
                await settled(service)
                await until(lambda: held_back(service).keys() == {"unconfirmed"})
                assert vehicle.sets == []
                return
        async with daemon(document) as again:
            await settled(again)
            await until(lambda: held_back(again).keys() == {"unconfirmed"})
            assert vehicle.sets == []


async def test_the_same_board_after_a_reboot_goes_on(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await learned_but_not_written(service, vehicle)
        vehicle.reboot()
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert not notices(service, "another_board")
        assert in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)


async def test_the_same_board_after_a_restart_waits_for_a_flight_or_a_person(
    document, daemon, port
):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            await learned_but_not_written(service, vehicle)
        async with daemon(document) as again:
            await settled(again)
            assert "no flight has confirmed it" in held_back(again)["unconfirmed"]
            assert vehicle.sets == []
            convinced(again, WANTED)  # it has flown
            await until(lambda: again.snapshot().push.can_roll_back == (1,))


async def test_a_person_who_has_read_why_it_waits_may_approve(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            await learned_but_not_written(service, vehicle)
        async with daemon(document) as again:
            await settled(again)
            await again.approve((1,))
            await until(lambda: again.snapshot().push.can_roll_back == (1,))
            (planned,) = [e for _, e in again.parts.journal.entries if isinstance(e, Planned)]
            assert planned.support.approved
            assert planned.plan.vehicle.board == vehicle.board


async def test_a_bench_calibration_while_the_daemon_was_off_stays(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            await learned_but_not_written(service, vehicle)
        vehicle.parameters["INS_ACCOFFS_X"] = 0.25
        async with daemon(document) as again:
            await settled(again)
            assert "unconfirmed" in held_back(again)
            assert vehicle.sets == []


async def test_values_that_somebody_has_changed_since_the_flight_stay(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await learned_but_not_written(service, vehicle)
        vehicle.armed = True
        await until(lambda: held_back(service).keys() == {"armed"})
        vehicle.set_by_other("INS_ACCOFFS_Y", 0.25)
        await until(lambda: "unconfirmed" in held_back(service))
        vehicle.armed = False
        await until(lambda: held_back(service).keys() == {"unconfirmed"})
        why = held_back(service)["unconfirmed"]
        assert "INS_ACCOFFS_Y from 0.06 to 0.25" in why
        assert vehicle.sets == []


@pytest.mark.parametrize("approval", [True, False])
async def test_what_a_ground_station_sets_during_a_push_stays(document, daemon, port, approval):
    document["push"]["approval"] = approval
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        if approval:
            await until(lambda: service.snapshot().push.approval_needed)
            await service.approve((1,))
        await until(lambda: len(vehicle.sets) >= 6)
        vehicle.set_by_other("INS_ACCOFFS_Y", 1.25)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert "rolled back" in service.snapshot().push.last_outcome
        service.parts.proposals.standing(1).not_before = 0.0  # the pause of 30 s is over
        vehicle.sets.clear()
        await ticks(service, 20)
        assert vehicle.sets == []
        assert vehicle.parameters["INS_ACCOFFS_Y"] == 1.25
        assert "unconfirmed" in held_back(service)
        await service.approve((1,))  # now that a person has seen both values
        await until(lambda: service.snapshot().push.can_roll_back == (1,))


async def test_an_approval_is_for_the_old_values_too(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED)
        await until(lambda: {"armed", "approval"} <= held_back(service).keys())
        await service.approve((1,))
        await until(lambda: held_back(service).keys() == {"armed"})
        vehicle.set_by_other("INS_ACCSCAL_X", 1.0625)
        await until(lambda: "approval" in held_back(service))
        vehicle.armed = False
        await ticks(service, 20)
        assert vehicle.sets == []


async def test_what_is_written_is_what_was_approved(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED)
        await until(lambda: {"armed", "approval"} <= held_back(service).keys())
        await service.approve((1,))
        moved = calibration(scale=(1.0205, 0.99, 1.01))  # half a sigma: the approval stands
        convinced(service, moved)
        await until(lambda: service.handover.learned.calibrations[1].scale == moved.scale)
        vehicle.armed = False
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)


async def test_a_push_of_another_board_is_neither_audited_nor_rolled_back_on_this_one(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        vehicle.sets.clear()
        six = dict(zip(vehicle.parameters, vehicle.parameters.values(), strict=True))
        becomes(vehicle, ANOTHER, INS_ACCSCAL_X=six["INS_ACCSCAL_X"])
        vehicle.reboot()
        await until(lambda: service.counters["autopilot_rebooted"] == 1)
        await settled(service)
        assert vehicle.sets == []
        assert service.snapshot().push.can_roll_back == ()


async def test_a_flight_is_judged_though_the_power_goes_right_after_the_landing(
    document, daemon, port, monkeypatch
):
    """What was found is kept for the next start; it is not written then without more."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await settled(service, 1)
        examined = []
        learner = service.handover._learner
        monkeypatch.setattr(type(learner._examiner), "waiting", (1,))
        monkeypatch.setattr(
            learner, "examine", lambda: examined.append(1) or learner.learn((), judging=())
        )
        vehicle.stop_talking()
        await until(lambda: service.snapshot().link.state == "silent")
        examined.clear()
        await until(lambda: examined)
        assert not service.handover.identified


@pytest.mark.parametrize("board", ["0a0b0c" + 30 * "0", ""])
async def test_a_system_id_that_is_set_while_the_service_runs_is_followed(
    document, daemon, port, board
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.board = board
        before = await push_done(service, vehicle)
        await until(lambda: service.snapshot().push.state == "idle")
        vehicle.sets.clear()
        vehicle.rename(7)
        await until(lambda: service.snapshot().link.system_id == 7)
        await settled(service, 80)
        assert service.snapshot().link.warnings == ()
        assert vehicle.sets == []
        if not board:  # nobody can say that it is the same one
            assert service.snapshot().push.can_roll_back == ()
            assert service.snapshot().push.proposals == ()
            return
        assert service.snapshot().push.can_roll_back == (1,)
        await until(lambda: service.snapshot().link.armed is False)
        await asyncio.sleep(10.0)
        await service.rollback((1,))
        await until(lambda: service.snapshot().push.can_roll_back == ())
        assert in_force(vehicle) == before


@pytest.mark.parametrize("board", ["0a0b0c" + 30 * "0", ""])
async def test_a_board_with_another_system_id_is_known_again_if_it_says_which_it_is(
    document, daemon, port, board
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.board = board
        before = await push_done(service, vehicle)
        await until(lambda: service.snapshot().push.state == "idle")
        vehicle.stop_talking()
        async with Vehicle(port, system=7, parameters=vehicle.parameters) as renamed:
            renamed.board = board
            await until(lambda: service.snapshot().link.state == "silent")
            (warning,) = service.snapshot().link.warnings
            assert "system 1 is silent, but system 7 speaks" in warning
            said = service.parts.notices
            await until(lambda: warning in [n.text for n in said.kept])
            await asyncio.sleep(1.0)
            assert [n.text for n in said.kept].count(warning) == 1, "it is told once"
    async with (
        daemon(document) as again,
        Vehicle(port, system=7, parameters=vehicle.parameters) as renamed,
    ):
        renamed.board = board
        await settled(again, 80)
        assert again.snapshot().link.system_id == 7
        assert again.snapshot().link.warnings == ()
        if not board:
            assert again.snapshot().push.can_roll_back == ()
            assert again.snapshot().push.proposals == ()
            return
        assert again.snapshot().push.can_roll_back == (1,)
        assert again.snapshot().push.proposals
        await again.rollback((1,))
        await until(lambda: again.snapshot().push.can_roll_back == ())
        assert in_force(renamed) == before
