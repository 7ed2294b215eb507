"""Two vehicles with one system id on one line: each hears what is written to the other."""

import asyncio

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
OTHER = "0f0f0f" + 30 * "0"


class Pair(Vehicle):
    """What a line carries on which two answer; they differ in what they say of themselves."""

    both = True

    def _introduce(self):
        super()._introduce()
        if self.both:
            ours, self.board = self.board, OTHER
            super()._introduce()
            self.board = ours


async def test_nothing_is_written_while_both_are_there_nor_before_a_reset(document, daemon, port):
    async with daemon(document) as service, Pair(port) as vehicle:
        await until(lambda: notices(service, "two_vehicles"))
        convinced(service, WANTED)
        await asyncio.sleep(60.0)
        assert vehicle.sets == []
        snapshot = service.snapshot()
        assert snapshot.mode == "advise_only"
        assert any("two autopilots answer as system 1" in text for text in snapshot.link.warnings)
        assert len(notices(service, "two_vehicles")) == 1
        vehicle.both = False
        await until(lambda: service.snapshot().mode == "active")
        assert not any("two autopilots" in text for text in service.snapshot().link.warnings)
        await until(lambda: "doubtful" in held_back(service))
        assert vehicle.sets == []
        await service.reset(())
        convinced(service, WANTED)
        await until(lambda: pushed(vehicle))


async def test_one_that_comes_later_is_found_and_gets_nothing(document, daemon, port):
    async with daemon(document) as service, Pair(port) as vehicle:
        vehicle.both = False
        before = await push_done(service, vehicle)
        vehicle.both = True
        await until(lambda: notices(service, "two_vehicles"))
        with pytest.raises(RefusedError, match="two autopilots"):
            await service.rollback((1,))
        count = len(vehicle.sets)
        vehicle.both = False
        await until(lambda: service.snapshot().mode == "active")
        await service.rollback((1,))
        await until(lambda: in_force(vehicle) == pytest.approx(before))
        assert len(vehicle.sets) > count
