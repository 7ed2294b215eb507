"""Two vehicles with one system id on one line: each hears what is written to the other."""

import asyncio

import pytest

from onboard.daemon.pushing.parameters import NEEDED
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


class Second(Vehicle):
    """Another board on the same line; neither tells its unique id."""

    def __init__(self, first, *, apart):
        super().__init__(0)
        self.board = first.board = ""
        self.boot_ms = first.boot_ms + 1e3 * apart + 7.0
        self._first = first

    async def __aenter__(self):
        first = self._first
        self._transport, self._address = first._transport, first._address
        alone = first.datagram_received

        def both(data, address):
            alone(data, address)
            self.datagram_received(data, address)

        first.datagram_received = both
        self._task = asyncio.create_task(self._stream(), name="second vehicle")
        return self

    async def __aexit__(self, *_):
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)


@pytest.mark.parametrize("apart", [0.05, 1.0, 60.0, -60.0])
async def test_two_that_tell_no_unique_id_are_noticed_and_nothing_is_written(
    document, daemon, port, apart
):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.parameters["INS_GYROFFS_X"] = 0.0123
        second = Second(vehicle, apart=apart)
        second.parameters["INS_GYROFFS_X"] = -0.0045
        async with second:
            await until(lambda: notices(service, "two_vehicles"))
            convinced(service, WANTED)
            document["push"]["approval"] = service.parts.proposals.approval = False
            sent = len(vehicle.heard)
            await asyncio.sleep(40.0)
            assert vehicle.sets == second.sets == []
            assert service.snapshot().mode == "advise_only"
            assert len(notices(service, "two_vehicles")) == 1
            assert service.snapshot().link.counters["reboots"] <= 1
            assert len(vehicle.heard) - sent < 40 * 20, "they are not asked over and over again"


async def test_values_that_change_are_asked_for_at_a_pace(document, daemon, port):
    """Of two, each contradicts the other at every answer."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        second = Second(vehicle, apart=0.05)
        for name in list(second.parameters):
            second.parameters[name] += 1.0
        async with second:
            await until(lambda: service.snapshot().counters.get("parameters_changed"))
            asked = vehicle.heard.count("PARAM_REQUEST_READ")
            await asyncio.sleep(60.0)
            asked = vehicle.heard.count("PARAM_REQUEST_READ") - asked
            assert asked < 8 * len(NEEDED), "each every ten seconds, and all every thirty"


async def test_what_was_learned_of_a_silent_one_is_not_given_up_for_another_of_its_name(
    document, daemon, port
):
    """From an address of its own, with a clock of its own: beside it, and while it is silent."""
    async with daemon(document) as service, Vehicle(port) as vehicle, Vehicle(port) as other:
        other.board, other.boot_ms = OTHER, vehicle.boot_ms + 3e5
        await until(lambda: service.link.presence.proven)
        way = service.link.presence.way
        await push_done(service, vehicle)
        await asyncio.sleep(15.0)
        vehicle.stop_talking()
        await asyncio.sleep(30.0)
        assert service.link.presence.way == way
        (text,) = notices(service, "another_speaks")
        assert "another one, by its clock, speaks as system 1, too" in text
        assert text in service.snapshot().link.warnings
        vehicle.talk_again()
        await until(lambda: service.snapshot().link.state == "present")
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert not notices(service, "autopilot_rebooted")
        assert not notices(service, "another_board")
        assert other.sets == []
