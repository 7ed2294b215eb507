"""A broker, and publishers that are little patient with it."""

import asyncio
import contextlib
import random
import time

import pytest

from onboard.daemon.mqtt.publisher import Publisher
from tests.mqtt.broker import Broker
from tests.mqtt.published import Obedient, noticeboard, settings


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr("onboard.daemon.mqtt.limits.BACKOFF_BASE_S", 0.05)
    monkeypatch.setattr("onboard.daemon.mqtt.limits.BACKOFF_CAP_S", 0.2)
    monkeypatch.setattr("onboard.daemon.mqtt.limits.ANSWER_S", 3.0)
    monkeypatch.setattr("onboard.daemon.mqtt.limits.FAREWELL_S", 0.5)


@pytest.fixture
async def broker(tmp_path):
    async with Broker(tmp_path) as running:
        yield running


@pytest.fixture
def publishing():
    """``async with publishing(port) as publisher``, which runs and is closed in good order."""

    @contextlib.asynccontextmanager
    async def run(port, *, actions=None, **changes):
        notices, kept = noticeboard()
        publisher = Publisher(
            settings(host="127.0.0.1", port=port, **changes),
            actions or Obedient(),
            notices,
            clock=time.monotonic,
            rng=random.Random(1),
        )
        publisher.kept = kept
        task = asyncio.create_task(publisher.run(), name="publisher")
        try:
            yield publisher
        finally:
            await publisher.close()
            await task

    return run
