"""A write that arrives when its transaction was taken back long ago: half a set, and it is said."""

import asyncio

import pytest

from tests.daemon.daemons import (
    SIX,
    WANTED,
    calibration,
    convinced,
    held_back,
    in_force,
    notices,
    push_done,
    pushed,
    ticks,
    until,
)
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def taken_back(service, vehicle):
    """A push that a person rejects in the middle, and the write of it of which a copy is late."""
    before = in_force(vehicle)
    vehicle.sets.clear()
    vehicle.when_set[4] = lambda: asyncio.get_running_loop().create_task(service.reject((1,)))
    convinced(service, WANTED)
    await until(lambda: notices(service, "push_rolled_back"))
    assert in_force(vehicle) == before
    return before, vehicle.sets[1]


async def test_it_is_said_and_a_person_may_have_it_put_back(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before, late = await taken_back(service, vehicle)
        sets = len(vehicle.sets)
        vehicle.set_by_other(*late)
        await until(lambda: notices(service, "push_late"))
        (one,) = service.snapshot().push.unfinished
        assert one.half
        assert late[0] in one.sentence.split("old")[0]
        assert "onboard rollback 1" in service.snapshot().next_step.text
        await ticks(service, 10)
        assert len(vehicle.sets) == sets, "nothing is written unasked"
        await service.rollback((1,))
        await until(lambda: in_force(vehicle) == before and not service.parts.pusher.busy)
        assert service.snapshot().push.unfinished == ()


async def test_it_is_not_taken_for_somebodys_will_over_an_earlier_push(document, daemon, port):
    """The push before it stays ours, and can be rolled back when the late copy is gone."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await push_done(service, vehicle)
        first = in_force(vehicle)
        await until(lambda: service.snapshot().push.state == "idle")
        other = tuple(x + 0.1 for x in WANTED.offset)
        answer = calibration(offset=other, in_force_scale=first[:3], in_force_offset=first[3:])
        vehicle.sets.clear()
        vehicle.when_set[2] = lambda: asyncio.get_running_loop().create_task(service.reject((1,)))
        convinced(service, answer)
        await until(lambda: notices(service, "push_rolled_back"))
        assert in_force(vehicle) == first
        vehicle.set_by_other(*vehicle.sets[0])
        await until(lambda: notices(service, "push_late"))
        assert notices(service, "push_replaced") == []
        await service.rollback((1,))
        await until(lambda: in_force(vehicle) == first and not service.parts.pusher.busy)
        assert pushed(vehicle)
        assert service.snapshot().push.can_roll_back == (1,)


async def test_who_sets_all_six_from_a_file_is_left_alone(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await taken_back(service, vehicle)
        for name, value in zip(SIX, WANTED.scale + WANTED.offset, strict=True):
            vehicle.set_by_other(name, value)
        await ticks(service, 10)
        assert notices(service, "push_late") == []
        assert service.snapshot().push.unfinished == ()
        assert "refused" in held_back(service) or pushed(vehicle)
