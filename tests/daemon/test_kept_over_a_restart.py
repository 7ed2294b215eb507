"""What a service knows of a flight and of a person's word outlives it."""

import pytest

from tests.daemon.daemons import (
    WANTED,
    convinced,
    held_back,
    in_force,
    push_done,
    ticks,
    until,
)
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def test_a_proposal_outlives_the_service(document, daemon, port):
    document["push"]["approval"] = True
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            convinced(service, WANTED, effects=("gps_latency",))
            await until(lambda: service.snapshot().push.approval_needed)
            (proposed,) = service.snapshot().push.proposals
            diagnosis = service.snapshot().diagnosis
        async with daemon(document) as again:
            await until(lambda: again.snapshot().push.approval_needed)
            (resumed,) = again.snapshot().push.proposals
            assert resumed.changes == proposed.changes
            assert resumed.held_back.keys() == {"approval", "unconfirmed"}
            assert again.snapshot().diagnosis == diagnosis
            found = [line for line in again.snapshot().journal if line.kind == "found"]
            assert len(found) == 1, "it was made once"
            await again.approve((1,))
            await until(lambda: again.snapshot().push.can_roll_back == (1,))
            assert in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)


async def test_what_the_diagnosis_forbids_it_forbids_after_a_restart(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            convinced(service, WANTED, missing="the antenna is elsewhere")
            await until(lambda: "physics_missing" in held_back(service))
        async with daemon(document) as again:
            await until(lambda: "physics_missing" in held_back(again))
            await until(lambda: held_back(again).keys() == {"physics_missing", "unconfirmed"})
            assert vehicle.sets == []


async def test_a_diagnosis_is_of_one_sensor_and_of_no_other(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            vehicle.armed = True
            convinced(service, WANTED)
            await until(lambda: held_back(service).keys() == {"armed"})
        vehicle.armed = False
        vehicle.parameters["INS_ACC_ID"] = 4711.0
        async with daemon(document) as again:
            await until(lambda: again.parts.parameters.complete)
            await ticks(again, 20)
            assert again.snapshot().push.proposals == ()
            assert vehicle.sets == []


@pytest.mark.slow
async def test_a_new_flight_ends_what_was_kept(document, daemon, port):
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            vehicle.armed = True
            convinced(service, WANTED)
            await until(lambda: held_back(service).keys() == {"armed"})
        async with daemon(document) as again:  # the vehicle is flying when it starts
            await until(lambda: again.snapshot().link.armed)
            await until(lambda: again.parts.parameters.complete)
            vehicle.armed = False
            await until(lambda: again.snapshot().link.armed is False)
            await ticks(again, 20)
            assert vehicle.sets == []


@pytest.mark.slow
@pytest.mark.parametrize("how", ["rejected", "rolled back"])
async def test_what_a_person_has_refused_stays_refused_after_a_restart(document, daemon, port, how):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            if how == "rejected":
                vehicle.armed = True
                convinced(service, WANTED)
                await until(lambda: service.snapshot().push.proposals)
                await service.reject((1,))
            else:
                await push_done(service, vehicle)
                await until(lambda: service.snapshot().link.armed is False)
                await service.rollback(())
                await until(lambda: service.snapshot().push.can_roll_back == ())
        vehicle.armed = False
        async with daemon(document) as again:
            await until(lambda: "refused" in held_back(again))
            await ticks(again, 20)
            assert in_force(vehicle) == before
            await again.approve((1,))
            await until(lambda: again.snapshot().push.can_roll_back == (1,))
        async with daemon(document) as third:
            await until(lambda: third.parts.parameters.complete)
            assert third.parts.journal.refusals() == {}
