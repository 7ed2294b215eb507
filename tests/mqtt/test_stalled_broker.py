"""A broker that hangs does not hold up the end of the service, in virtual time."""

import asyncio

import pytest

from onboard.daemon.mqtt import publisher as publisher_module
from onboard.daemon.mqtt.publisher import Publisher
from onboard.daemon.view.notices import Notices
from tests.mavlink.virtual_time import virtual_time
from tests.mqtt.published import Obedient, settings, snapshot

STOP_S = 2.0


class Stalled:
    """In the place of aiomqtt's client: takes so many publications, then confirms nothing."""

    takes = 0
    overlong = False
    made = 0

    def __init__(self, *_args, timeout, **_keywords):
        Stalled.made += 1
        self.timeout = timeout
        self.messages = self._silence()

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_error):
        await asyncio.sleep(self.timeout)
        raise publisher_module.aiomqtt.MqttError("Operation timed out")

    async def publish(self, *_args, timeout=None, **_keywords):  # noqa: ASYNC109 - its interface
        if Stalled.takes > 0:
            Stalled.takes -= 1
            return
        await asyncio.sleep(self.timeout if timeout is None else timeout)
        raise publisher_module.aiomqtt.MqttError("Operation timed out")

    async def _silence(self):
        await asyncio.Event().wait()
        yield


@pytest.mark.parametrize("takes", [0, 1, 2, 3])
@pytest.mark.parametrize("before_s", [0.5, 12.0, 40.0])
@virtual_time
async def test_the_farewell_is_short(monkeypatch, takes, before_s):
    monkeypatch.setattr(publisher_module, "Client", Stalled)
    monkeypatch.setattr(Stalled, "takes", takes)
    monkeypatch.setattr(Stalled, "made", 0)
    loop = asyncio.get_running_loop()
    publisher = Publisher(settings(), Obedient(), Notices(loop.time), clock=loop.time)
    task = asyncio.create_task(publisher.run())
    publisher.publish(snapshot())
    await asyncio.sleep(before_s)
    began = loop.time()
    await publisher.close(snapshot())
    await task
    assert Stalled.made > 0
    assert loop.time() - began < STOP_S
