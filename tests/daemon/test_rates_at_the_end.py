"""Samples make room for a push; a service that ends with it has them come as before."""

import asyncio

import pytest

from onboard.mavlink.limits import SELDOM_MS
from tests.daemon.daemons import WANTED, convinced, made, pushed, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def push_with_few_samples(document, vehicle):
    """A push on a line that brings less than was granted, as the service is about to end."""
    service = made(document)
    task = asyncio.create_task(service.run())
    await until(lambda: vehicle.intervals_us)
    await asyncio.sleep(10.0)  # what comes is measured
    usual = dict(vehicle.intervals_us)
    assert all(interval_us < 1e3 * SELDOM_MS for interval_us in list(usual.values())[:5])
    convinced(service, WANTED)
    await until(lambda: len(vehicle.sets) > 1)
    assert set(vehicle.intervals_us.values()) >= {1e3 * SELDOM_MS}
    return service, task, usual


async def test_a_service_that_ends_as_its_push_does(document, port):
    async with Vehicle(port) as vehicle:
        service, task, usual = await push_with_few_samples(document, vehicle)
        await until(service.parts.pusher.idle.is_set)
        service.stop()
        await task
        assert pushed(vehicle)
        assert vehicle.intervals_us == usual | {0: 0.0}


async def test_a_service_that_has_to_leave_its_push_open(document, port):
    async with Vehicle(port) as vehicle:
        service, task, usual = await push_with_few_samples(document, vehicle)
        vehicle.mute_after_sets = len(vehicle.sets)
        service.stop()
        await task
        assert not pushed(vehicle)
        assert vehicle.intervals_us == usual | {0: 0.0}
