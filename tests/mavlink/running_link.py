"""A link under way in virtual time, and what is said to it."""

from __future__ import annotations

import asyncio
import random
from contextlib import asynccontextmanager

from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.link import Link
from tests.mavlink.mavlink_peer import heartbeat

UDP = Endpoint.parse("udpin:127.0.0.1:14550")
TCP = Endpoint.parse("tcp:127.0.0.1:5760")


@asynccontextmanager
async def under_way(link):
    """A link that runs; stopped at the end."""
    task = asyncio.create_task(link.run())
    await asyncio.sleep(0.01)
    try:
        yield link
    finally:
        link.close()
        await task


@asynccontextmanager
async def running(*endpoints, **kwargs):
    """A link under way, with the events it emitted."""
    clock = asyncio.get_running_loop().time
    kwargs = {"rng": random.Random(1), **kwargs}
    link = Link(endpoints or (UDP,), clock=clock, wall_clock=clock, **kwargs)
    link.events = []
    link.subscribe_events(lambda now, event: link.events.append(event))
    async with under_way(link):
        yield link


def events(link, kind):
    return [event for event in link.events if isinstance(event, kind)]


async def beat(transport, seconds, *messages):
    """A heartbeat a second, and the messages with it."""
    for _ in range(round(seconds)):
        for message in (heartbeat(), *messages):
            transport.say(message)
        await asyncio.sleep(1.0)
