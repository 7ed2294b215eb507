"""What earlier pushes still ask for: after crashes, power cuts, reboots, and of other vehicles."""

import asyncio

import pytest

from onboard.push.entries import Verdict, Watched
from tests.daemon.daemons import (
    SIX,
    WANTED,
    convinced,
    held_back,
    in_force,
    made,
    notices,
    push_done,
    ticks,
    until,
)
from tests.daemon.standing_vehicle import Vehicle, ardupilot_parameters

pytestmark = pytest.mark.virtual_time


async def crashed_in_the_middle(document, vehicle):
    """A push of which half is written, by a daemon that is no more."""
    vehicle.mute_after_sets = 3
    service = made(document)
    task = asyncio.create_task(service.run())
    convinced(service, WANTED)
    await until(lambda: len(vehicle.sets) == 3)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    vehicle.mute_after_sets = None
    vehicle.sets.clear()


async def test_an_open_write_of_another_vehicle_is_said_once_and_waits(document, daemon, port):
    async with Vehicle(port) as vehicle:
        await crashed_in_the_middle(document, vehicle)
        vehicle.parameters["INS_ACC_ID"] = 4711.0  # somebody has swapped the board
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_other_vehicle"))
            await ticks(service, 20)
            assert service.snapshot().counters["resumed"] == 1
            assert vehicle.sets == []
            assert service.snapshot().push.state == "interrupted"
            # The right board is back: that takes a power cycle, and so a reboot.
            vehicle.parameters["INS_ACC_ID"] = 2_700_001.0
            vehicle.reboot()
            await until(lambda: service.snapshot().push.state == "idle")
            assert "rolled back" in service.snapshot().push.last_outcome


async def test_an_identifier_that_is_right_again_needs_no_reboot(document, daemon, port):
    """Somebody has set INS_ACC_ID in the middle, and set it right: half a set is in force."""
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        await crashed_in_the_middle(document, vehicle)
        vehicle.parameters["INS_ACC_ID"] = 4711.0
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_other_vehicle"))
            await ticks(service, 20)
            assert vehicle.sets == []
            (one,) = service.snapshot().push.unfinished
            assert one.half
            assert "INS_ACC_ID is another accelerometer's" in one.next
            vehicle.set_by_other("INS_ACC_ID", 2_700_001.0)
            await until(lambda: service.snapshot().push.state == "idle")
            assert in_force(vehicle) == before


async def test_an_open_write_of_another_board_does_not_stand_in_the_way(document, daemon, port):
    async with Vehicle(port) as vehicle:
        await crashed_in_the_middle(document, vehicle)
        vehicle.board = "0badc0ffee"
        vehicle.parameters = ardupilot_parameters()
        before = in_force(vehicle)
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_other_vehicle"))
            convinced(service, WANTED)
            await until(lambda: service.snapshot().push.can_roll_back == (1,))
            assert in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)
            assert service.snapshot().push.state == "interrupted", "there is the other one"
            await service.rollback((1,))
            await until(lambda: service.snapshot().push.can_roll_back == ())
            assert in_force(vehicle) == before


async def test_a_resumption_that_fails_is_tried_again_after_a_pause(document, daemon, port):
    async with Vehicle(port) as vehicle:
        await crashed_in_the_middle(document, vehicle)
        vehicle.mute_after_sets = 0  # it can be read, but takes no writes
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_interrupted"))
            await ticks(service, 10)
            assert service.snapshot().counters["resumed"] == 1
            vehicle.mute_after_sets = None
            service.parts.pusher._duties.not_before.clear()  # the pause is over
            await until(lambda: service.snapshot().push.state == "idle")
            assert "rolled back" in service.snapshot().push.last_outcome


async def test_what_a_reboot_has_kept_stays(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await push_done(service, vehicle)
        vehicle.sets.clear()
        vehicle.reboot()
        await until(lambda: notices(service, "push_stored"))
        assert vehicle.sets == []
        assert service.snapshot().push.can_roll_back == (1,)


async def test_what_a_reboot_has_lost_in_part_is_undone_altogether(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        await push_done(service, vehicle)
        vehicle.parameters["INS_ACCSCAL_Y"] = before[1]  # was not stored
        vehicle.reboot()
        await until(lambda: notices(service, "push_not_stored"))
        assert service.snapshot().push.state != "idle"
        await until(lambda: service.snapshot().push.state == "idle")
        assert service.snapshot().push.can_roll_back == ()
        assert in_force(vehicle) == before
        kinds = [line.kind for line in service.snapshot().journal]
        assert kinds[-1] == "closed"


async def test_a_way_back_that_a_reboot_has_lost_is_said_and_offered_again(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        await push_done(service, vehicle)
        values = in_force(vehicle)
        await until(lambda: service.snapshot().push.state == "idle")
        await service.rollback((1,))
        await until(lambda: service.snapshot().push.can_roll_back == ())
        assert in_force(vehicle) == before
        vehicle.parameters.update(zip(SIX, values, strict=True))  # was not stored
        vehicle.reboot()
        await until(lambda: notices(service, "roll_back_not_stored"))
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert in_force(vehicle) == values, "nobody has said that they are worse"
        assert "refused" in held_back(service)


async def test_of_values_found_worse_a_way_back_that_was_lost_is_gone_again(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        await push_done(service, vehicle)
        values = in_force(vehicle)
        push = service.parts.pusher
        transaction = push._ledger.in_force(1).transaction
        push.judge([Watched(transaction, Verdict.WORSE, "it flew worse")])
        await until(lambda: service.snapshot().push.can_roll_back == ())
        assert in_force(vehicle) == before
        vehicle.parameters["INS_ACCSCAL_Y"] = values[1]  # was not stored
        vehicle.reboot()
        await until(lambda: notices(service, "roll_back_not_stored"))
        await until(lambda: in_force(vehicle) == before)
        await until(lambda: service.snapshot().push.state == "idle")
        vehicle.boot_ms += 60_000.0  # it runs for a minute
        await ticks(service, 40)
        vehicle.parameters.update(zip(SIX, values, strict=True))  # nothing of it was
        vehicle.reboot()
        await until(lambda: len(notices(service, "roll_back_completed")) == 2)
        assert in_force(vehicle) == before


@pytest.mark.slow
async def test_a_reboot_while_the_daemon_was_off_is_audited_at_its_start(document, daemon, port):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            await push_done(service, vehicle)
        for name, value in zip(SIX, before, strict=True):
            vehicle.parameters[name] = value
        vehicle.sets.clear()
        async with daemon(document) as again:
            await until(lambda: notices(again, "push_gone"))
            await until(lambda: again.snapshot().push.can_roll_back == ())
            assert vehicle.sets == [], "all six are old already: it only has to be written down"
            assert again.snapshot().push.last_outcome is None
            assert not notices(again, "push_resumed")


@pytest.mark.parametrize(
    ("then", "push"),
    [
        ("silence", {}),
        ("reboot", {}),
        ("restart", {}),
        ("silence", {"policy": "never"}),
        ("reboot", {"approval": True}),
    ],
)
async def test_what_somebody_has_set_before_our_eyes_stays_whatever_comes(
    document, daemon, port, then, push
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            await push_done(service, vehicle)
            await service.reject((1,))
        document["push"] |= push
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_stored"))
            for name, value in zip(SIX[:3], before[:3], strict=True):
                vehicle.set_by_other(name, value)
            await until(lambda: notices(service, "push_replaced"))
            mixed = in_force(vehicle)
            vehicle.sets.clear()
            if then == "silence":
                vehicle.stop_talking()
                await until(lambda: service.snapshot().link.state == "silent")
                vehicle.talk_again()
            elif then == "reboot":
                vehicle.reboot()
            if then != "restart":
                await until(lambda: not service.handover.identified)
                await until(lambda: service.parts.parameters.complete)
                await ticks(service, 200)
        async with daemon(document) as again:
            await until(lambda: again.parts.parameters.complete)
            await ticks(again, 200)
            assert not notices(again, "push_mixed")
        assert vehicle.sets == []
        assert in_force(vehicle) == mixed
        said = {*service.snapshot().notices, *again.snapshot().notices}
        assert not [n.text for n in said if "taken back" in n.text or "interrupted" in n.text]


async def test_what_a_reboot_in_a_silence_has_lost_is_nobodys_will(document, daemon, port):
    """Its clock is further on than when it fell silent: the silence outlasts the boot before it."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.boot_ms = 1000.0
        before = in_force(vehicle)
        await push_done(service, vehicle)
        await service.reject((1,))
        await until(lambda: service.parts.parameters.complete)
        await ticks(service, 20)
        vehicle.sets.clear()
        vehicle.stop_talking()
        heard = vehicle.boot_ms
        await asyncio.sleep(300.0)
        vehicle.parameters |= dict(zip(SIX[:3], before[:3], strict=True))  # as they were stored
        vehicle.boot_ms = -30_000.0  # booted half a minute after that
        vehicle.talk_again()
        assert vehicle.boot_ms > heard
        await until(lambda: notices(service, "push_mixed"))
        assert notices(service, "autopilot_rebooted") == [
            "the autopilot rebooted while it was silent"
        ]
        assert notices(service, "push_replaced") == []
        assert service.handover.learned.counters["event_Restarted"] == 1
        assert vehicle.sets == []
        await until(lambda: service.snapshot().link.armed is False)
        await asyncio.sleep(10.0)
        await service.rollback((1,))
        await until(lambda: in_force(vehicle) == before)


@pytest.mark.parametrize("policy", ["landed", "never"])
async def test_what_nobody_has_seen_come_is_asked_and_put_back_when_a_person_says_so(
    document, daemon, port, policy
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            await push_done(service, vehicle)
        vehicle.parameters["INS_ACCSCAL_Y"] = before[1]  # lost, or set: nobody was there
        vehicle.sets.clear()
        document["push"]["policy"] = policy
        async with daemon(document) as again:
            await until(lambda: notices(again, "push_mixed"))
            await ticks(again, 200)
            assert vehicle.sets == []
            push = again.snapshot().push
            assert (push.state, push.can_roll_back) == ("idle", (1,))
            assert not push.written[0].in_force
            assert "some are those from before" in push.written[0].account.next
            assert await again.rollback((1,)) == "rolling back IMU 1"
            await until(lambda: again.snapshot().push.can_roll_back == ())
            assert in_force(vehicle) == before
            assert "a person had it put back" in again.snapshot().push.last_outcome
            await until(lambda: "refused" in held_back(again))
            assert "failed_before" not in held_back(again)


async def test_with_a_person_to_be_asked_even_what_a_reboot_has_lost_is_asked(
    document, daemon, port
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            await push_done(service, vehicle)
        document["push"]["approval"] = True
        async with daemon(document) as again:
            await until(lambda: notices(again, "push_stored"))
            vehicle.sets.clear()
            vehicle.parameters["INS_ACCSCAL_Y"] = before[1]
            vehicle.reboot()
            await until(lambda: notices(again, "push_mixed"))
            await ticks(again, 100)
            assert vehicle.sets == []
            assert again.snapshot().push.can_roll_back == (1,)


async def test_what_somebody_has_set_since_is_not_touched_by_an_audit(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await push_done(service, vehicle)
        await service.reject((1,))
        vehicle.sets.clear()
        vehicle.parameters["INS_ACCSCAL_Y"] = 1.03125
        vehicle.reboot()
        await until(lambda: service.snapshot().parameters["INS_ACCSCAL_Y"] == 1.03125)
        await ticks(service, 20)
        assert not notices(service, "push_not_stored")
        assert vehicle.sets == []


async def test_a_daemon_started_in_flight_waits_for_the_landing(document, daemon, port):
    async with Vehicle(port) as vehicle:
        vehicle.armed, vehicle.landed = True, False
        before = in_force(vehicle)
        async with daemon(document) as service:
            convinced(service, WANTED)
            await until(lambda: service.snapshot().push.proposals)
            await ticks(service, 20)
            assert vehicle.sets == []
            assert in_force(vehicle) == before
            vehicle.armed, vehicle.landed = False, True
            await until(lambda: service.snapshot().push.can_roll_back == (1,))


@pytest.mark.parametrize("where", ["feed", "poll", "consider"])
async def test_a_fault_of_ours_in_a_push_ends_the_service_and_the_next_start_undoes_it(
    document, daemon, port, where, monkeypatch
):
    """Who has lost count of what was written does not go on writing; the journal has not."""
    monkeypatch.setattr("onboard.daemon.process.limits.TICK_S", 0.05)  # a round between two writes
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        service = made(document)
        convinced(service, WANTED)
        sound = getattr(service.parts.pusher, where)

        def broken(*args, **kwargs):
            if len(vehicle.sets) >= 3:
                raise ArithmeticError(where)
            return sound(*args, **kwargs)

        setattr(service.parts.pusher, where, broken)
        task = asyncio.create_task(service.run())
        with pytest.raises((ArithmeticError, BaseExceptionGroup)):
            await asyncio.wait_for(task, 600.0)
        assert 3 <= len(vehicle.sets) < 6
        assert in_force(vehicle) != pytest.approx(before)
        async with daemon(document) as again:
            await until(lambda: not again.parts.journal.recover())
            assert in_force(vehicle) == pytest.approx(before)
