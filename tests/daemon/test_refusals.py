"""What the service is asked to do and does not do: each with its reason, and nothing written."""

import asyncio

import pytest

from onboard.errors import RefusedError, StateError
from onboard.push.entries import Verdict, Watched
from tests.daemon.daemons import WANTED, calibration, convinced, held_back, pushed, until
from tests.daemon.standing_vehicle import Vehicle, ardupilot_parameters
from tests.daemon.strangers import Stranger

pytestmark = pytest.mark.virtual_time
SECOND = calibration(2, in_force_offset=(0.05, 0.06, 0.07))


def both(service):
    return set(service.snapshot().push.can_roll_back)


def told(service, kind):
    return [notice.text for notice in service.snapshot().notices if notice.kind == kind]


async def test_of_several_pushes_one_is_rolled_back_by_its_number(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, SECOND)
        await until(lambda: both(service) == {1, 2})
        sets = len(vehicle.sets)
        with pytest.raises(RefusedError, match="one at a time"):
            await service.rollback(())
        with pytest.raises(RefusedError, match="no push is in force"):
            await service.rollback((3,))
        vehicle.armed = True
        await asyncio.sleep(8.0)  # arming and disarming at once would be a contradiction
        with pytest.raises(RefusedError, match="armed"):
            await service.rollback((2,))
        assert len(vehicle.sets) == sets
        vehicle.armed = False
        await asyncio.sleep(5.0)
        assert await service.rollback((2,)) == "rolling back IMU 2"
        with pytest.raises(RefusedError, match="under way"):
            await service.rollback((1,))
        await until(lambda: both(service) == {1})
        assert pushed(vehicle)


async def test_without_a_vehicle_that_may_be_written_nothing_is_rolled_back(document, daemon, port):
    async with daemon(document) as service, Vehicle(port):
        convinced(service, WANTED)
        await until(lambda: both(service) == {1})
        service.parts.proposals.forbidden = "another vehicle's"
        with pytest.raises(RefusedError, match="another vehicle's"):
            service.parts.pusher.roll_back((1,), service._clock())


async def test_a_plan_that_the_journal_does_not_take_is_not_begun(
    document, daemon, port, monkeypatch
):
    def full(*_):
        raise StateError("journal: No space left on device")

    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.handover.identified)
        monkeypatch.setattr(service.parts.journal, "append", full)
        convinced(service, WANTED)
        await until(lambda: service.snapshot().counters.get("journal_failed", 0) > 0)
        await asyncio.sleep(5.0)
        assert vehicle.sets == []
        assert both(service) == set()


async def test_an_approval_by_parameter_says_what_came_of_it(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        with Stranger(port) as station:
            station.set("OBC_APPROVE", 1.0)
            await until(
                lambda: any("nothing waits" in t for t in told(service, "parameter_denied"))
            )
            convinced(service, WANTED)
            await until(lambda: "approval" in held_back(service))
            station.set("OBC_APPROVE", 0.0)  # not yet, and no mistake
            await asyncio.sleep(2.0)
            assert len(told(service, "parameter_denied")) == 1
            assert vehicle.sets == []
            station.set("OBC_APPROVE", 1.0)
            await until(lambda: pushed(vehicle))
            assert any("approved" in text for text in told(service, "approved"))


async def test_tightening_by_parameter_holds_and_the_same_again_is_no_news(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.parts.parameters.complete)
        with Stranger(port) as station:
            for _ in range(3):
                station.set("OBC_PUSH", 0.0)
                await asyncio.sleep(1.0)
            assert told(service, "parameter_done") == ["push policy is now never"]
            convinced(service, WANTED)
            await until(lambda: "policy_never" in held_back(service))
            said = await service.approve((1,))
            assert "not written, for the push policy is 'never'" in said
            await asyncio.sleep(5.0)
            assert vehicle.sets == []


async def test_what_would_never_be_written_back_is_not(document, daemon, port, monkeypatch):
    """Neither for a person nor for a flight: old values of an older version, or made up."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: both(service) == {1})
        monkeypatch.setattr("onboard.push.limits.BACK_OFFSET_BOUND", 0.055)
        with pytest.raises(RefusedError, match=r"INS_ACCOFFS_Y = 0\.06"):
            await service.rollback((1,))
        transaction = service.parts.journal.last_completed(1).transaction
        service.parts.pusher.judge([Watched(transaction, Verdict.WORSE, "it flew worse")])
        await until(lambda: told(service, "push_superseded"))
        assert "not taken back" in told(service, "push_superseded")[0]
        await asyncio.sleep(5.0)
        assert pushed(vehicle)
        assert len(vehicle.sets) == 6


async def test_what_somebody_has_set_since_is_not_offered_for_a_roll_back(document, daemon, port):
    """Values put where they were pushed are again what a roll-back takes back."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: both(service) == {1})
        pushed_x = vehicle.parameters["INS_ACCOFFS_X"]
        vehicle.set_by_other("INS_ACCOFFS_X", 0.25)
        await until(lambda: both(service) == set())
        assert not service.snapshot().push.written[0].in_force
        with pytest.raises(RefusedError, match="no push is in force"):
            await service.rollback((1,))
        assert "refused" not in held_back(service)
        vehicle.set_by_other("INS_ACCOFFS_X", pushed_x)
        await until(lambda: both(service) == {1})
        assert service.snapshot().push.written[0].in_force


async def test_a_roll_back_that_comes_to_nothing_refuses_nothing(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: both(service) == {1})
        vehicle.parameters["INS_ACCOFFS_X"] = 0.25  # nobody has heard of it
        await service.rollback((1,))
        await until(lambda: "aborted" in service.snapshot().push.last_outcome)
        assert both(service) == set()
        assert "refused" not in held_back(service)
        assert service.parts.journal.refusals() == {}


async def test_of_a_silent_autopilot_nothing_is_rolled_back(document, daemon, port, caplog):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            convinced(service, WANTED)
            await until(lambda: both(service) == {1})
            await until(lambda: service.snapshot().push.state == "idle")
            vehicle.stop_talking()
            await until(lambda: service.snapshot().link.state == "silent")
            for _ in range(2):
                with pytest.raises(RefusedError, match="the autopilot is silent"):
                    await service.rollback((1,))
            assert service.snapshot().push.active_imu is None
        assert "left open" not in caplog.text


async def test_on_stop_only_what_was_written_is_said_to_be_left_open(
    document, daemon, port, caplog, monkeypatch
):
    monkeypatch.setattr("onboard.daemon.process.limits.FINISH_PUSH_S", 0.05)
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            convinced(service, WANTED)
            await until(lambda: both(service) == {1})
            vehicle.stop_talking()
            vehicle.parameters.clear()  # it answers nothing
            await service.rollback((1,))
        assert "left open" not in caplog.text


async def test_where_nothing_can_be_proposed_it_is_said_why(document, daemon, port):
    """Firmware, or a line, that does not tell which sensor it is: nothing happens for ever."""
    parameters = {n: v for n, v in ardupilot_parameters().items() if n != "INS_ACC_ID"}
    async with daemon(document) as service, Vehicle(port, parameters=parameters) as vehicle:
        convinced(service, WANTED, SECOND)
        await until(lambda: both(service) == {2})
        first, second = (imu.state for imu in service.snapshot().imus)
        assert (first.name, first.severity) == ("held_back", "warning")
        assert first.sentence.endswith("not written: the autopilot has not told INS_ACC_ID")
        assert second.name != "held_back"
        vehicle.parameters["INS_ACC_ID"] = 2_700_001.0  # it was unlucky, and is asked again
        await until(lambda: both(service) == {1, 2}, limit=600.0)
        assert pushed(vehicle)
