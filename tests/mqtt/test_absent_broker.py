"""A broker that is absent for long, in virtual time: one line at its beginning, one at its end."""

import asyncio
import logging

import pytest

from onboard.daemon.mqtt import publisher as publisher_module
from onboard.daemon.mqtt.publisher import Publisher
from onboard.daemon.view.notices import Notices
from tests.mavlink.virtual_time import virtual_time
from tests.mqtt.published import Obedient, settings, snapshot


class NoBroker:
    """In the place of aiomqtt's client: refuses until a time, then hangs on."""

    until = 0.0
    overlong = False

    def __init__(self, *_args, **_keywords):
        self.messages = self._silence()

    async def __aenter__(self):
        if asyncio.get_running_loop().time() < self.until:
            raise publisher_module.aiomqtt.MqttError("[Errno 111] Connection refused")
        return self

    async def __aexit__(self, *_error):
        return None

    async def publish(self, *_args, **_keywords):
        return None

    async def _silence(self):
        await asyncio.Event().wait()
        yield


@pytest.mark.parametrize("seconds", [30.0, 600.0])
@virtual_time
async def test_an_absent_broker_is_one_warning_and_one_recovery(seconds, monkeypatch, caplog):
    caplog.set_level(logging.INFO)
    monkeypatch.setattr(publisher_module, "Client", NoBroker)
    monkeypatch.setattr(NoBroker, "until", seconds)
    clock = asyncio.get_running_loop().time
    publisher = Publisher(settings(), Obedient(), Notices(clock), clock=clock)
    task = asyncio.create_task(publisher.run())
    for _ in range(round(seconds) + 120):
        publisher.publish(snapshot())
        await asyncio.sleep(1.0)
    await publisher.close()
    await task
    assert publisher.counters["mqtt_failures"] > 3
    lost, back = [r for r in caplog.records if "broker" in r.getMessage()]
    assert lost.levelno == logging.WARNING
    assert "refused" in lost.getMessage()
    assert f"{publisher.counters['mqtt_failures']} tries" in back.getMessage()
