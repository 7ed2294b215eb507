"""Half a set of six in force, and the service has just been killed: it is said everywhere."""

import asyncio
import json

import pytest

from onboard.daemon.mqtt.summary import summary
from onboard.daemon.outlets.announcer import LINES
from tests.daemon.daemons import (
    SIX,
    WANTED,
    convinced,
    held_back,
    in_force,
    notices,
    ticks,
    until,
)
from tests.daemon.standing_vehicle import Vehicle
from tests.daemon.test_unfinished_business import crashed_in_the_middle

pytestmark = pytest.mark.virtual_time
NEW = {"INS_ACCOFFS_X", "INS_ACCSCAL_X", "INS_ACCSCAL_Z"}
"""What is written of it when it is killed."""


def unfinished(service):
    found = service.snapshot().push.unfinished
    return found[0] if found else None


def everywhere(service):
    """Each place that a person looks at, and what it says."""
    snapshot = service.snapshot()
    return {
        "page and terminal": unfinished(service).next,
        "next step": snapshot.next_step.text,
        "broker": summary(snapshot).next,
        "service manager": service._portrait.sentence(service._clock()),
    }


async def test_who_armed_meanwhile_is_told_to_land_and_what_is_in_force(document, daemon, port):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        await crashed_in_the_middle(document, vehicle)
        vehicle.armed, vehicle.landed = True, False
        async with daemon(document) as service:
            await until(lambda: unfinished(service) and unfinished(service).half)
            await until(lambda: service.snapshot().link.armed)
            one = unfinished(service)
            now = {value.name: value.now for value in one.values}
            assert now == {name: pytest.approx(vehicle.parameters[name]) for name in SIX}
            told_new = one.sentence.split("old")[0]
            assert {name for name in SIX if name in told_new} == NEW
            for place, text in everywhere(service).items():
                assert "land and disarm" in text, place
            await until(lambda: notices(service, "half_written"))
            assert "land and disarm" in notices(service, "half_written")[0]
            assert json.loads(service.snapshot().to_json())["push"]["unfinished"][0]["half"]
            vehicle.landed = True  # armed on the ground: nothing is written
            await ticks(service, 20)
            assert vehicle.sets == []
            assert "land and disarm" in unfinished(service).next
            vehicle.armed = False
            await until(lambda: service.snapshot().push.state == "idle")
            assert in_force(vehicle) == before
            assert unfinished(service) is None
            assert "half" not in service._portrait.sentence(service._clock())


async def test_who_stands_is_told_not_to_arm_until_it_is_undone(document, daemon, port):
    async with Vehicle(port) as vehicle:
        await crashed_in_the_middle(document, vehicle)
        vehicle.mute_after_sets = 0  # it can be read, but takes no writes
        async with daemon(document) as service:
            await until(lambda: notices(service, "push_interrupted"))
            await until(lambda: unfinished(service) and unfinished(service).half)
            for place, text in everywhere(service).items():
                assert "do not arm" in text, place
            await until(lambda: notices(service, "half_written_standing"))
            told = len(notices(service, "half_written_standing"))
            # It is tried again soon: who stands beside it may arm at any moment.
            await asyncio.sleep(25.0)
            assert service.snapshot().counters["resumed"] > 2
            assert len(notices(service, "half_written_standing")) == told, "no news"
            vehicle.mute_after_sets = None
            await until(lambda: service.snapshot().push.state == "idle")
            assert "half" not in held_back(service)


async def test_before_the_values_are_read_nobody_is_told_that_all_is_well(document, daemon, port):
    async with Vehicle(port) as vehicle:
        await crashed_in_the_middle(document, vehicle)
        vehicle.stop_talking()
        async with daemon(document) as service:
            await asyncio.sleep(2.0)
            assert unfinished(service).half is None
            assert "not known yet" in unfinished(service).sentence
            assert "do not arm" in unfinished(service).next
            vehicle.talk_again()
            await until(lambda: service.snapshot().push.state == "idle")


async def test_what_was_told_before_it_was_written_is_no_news_of_it(document, daemon, port):
    """Nothing is answered from the first write on: whether that is in force nobody knows."""
    async with daemon(document) as service, Vehicle(port) as vehicle:
        tell = vehicle._tell
        vehicle.when_set[1] = lambda: setattr(vehicle, "_tell", lambda _: None)
        convinced(service, WANTED)
        await until(lambda: notices(service, "push_interrupted"))
        (name, _), *_ = vehicle.sets
        one = unfinished(service)
        assert one.half is None
        assert {v.name for v in one.values if v.now is None} == {name}
        for place, text in everywhere(service).items():
            assert "do not arm" in text, place
        vehicle._tell = tell
        await until(lambda: service.snapshot().push.state == "idle")


def test_a_ground_station_hears_of_it_as_of_nothing_graver():
    lines = [LINES["half_written"], LINES["half_written_standing"]]
    assert {line.severity for line in lines} == {min(line.severity for line in LINES.values())}
