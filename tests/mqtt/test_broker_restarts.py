"""A broker that is started anew in the middle: with its memory or without, with other passwords."""

import asyncio
import json
import logging
from typing import ClassVar

from onboard.daemon.mqtt import limits
from onboard.daemon.mqtt import publisher as publisher_module
from onboard.daemon.mqtt.publisher import Publisher
from onboard.daemon.view.notices import Notices
from tests.mavlink.virtual_time import virtual_time
from tests.mqtt.broker import Broker, Subscriber
from tests.mqtt.published import Obedient, imu_view, journal_line, kinds, settings, snapshot
from tests.mqtt.test_absent_broker import NoBroker
from tests.mqtt.test_publisher import hashed

RIGHT, ANOTHER = "right", "another"
AWAY_S = 3600.0


async def passwords(folder, password):
    """The broker's table of who may come in."""
    table = folder / "passwords"
    table.write_text(f"daemon:{password}\n")
    table.chmod(0o600)
    await hashed(table)
    return table


async def until(condition):
    async with asyncio.timeout(60.0):
        while not condition():
            await asyncio.sleep(0.01)


def calibrated(publisher, scale):
    publisher.publish(snapshot(imus=[imu_view(scale=scale)]))


async def test_a_broker_that_comes_back_with_another_password_is_told_of_once(
    tmp_path, publishing, monkeypatch
):
    # However slow the machine is, all of this is one outage.
    monkeypatch.setattr("onboard.daemon.mqtt.limits.STABLE_S", 600.0)
    secret = tmp_path / "secret"
    secret.write_text(RIGHT)
    secret.chmod(0o600)
    table = await passwords(tmp_path, RIGHT)
    lines = ("allow_anonymous false", f"password_file {table}")
    who = {"username": "daemon", "password": RIGHT}
    async with (
        Broker(tmp_path, *lines, credentials=who) as broker,
        publishing(broker.port, username="daemon", password_file=str(secret)) as publisher,
    ):
        calibrated(publisher, 1.01)
        await kinds(publisher, "mqtt_connected")
        publisher._backoff.next = lambda: 1.0  # it is back before the first try
        await passwords(tmp_path, ANOTHER)
        await broker.stop()
        await broker.start()
        told = publisher.kept
        await until(lambda: any("it refuses" in n.text for n in told))
        publisher._backoff.next = lambda: 0.01
        tries = publisher.counters["mqtt_failures"]
        await until(lambda: publisher.counters["mqtt_failures"] >= tries + 5)
        assert sum("it refuses" in n.text for n in told) == 1
        assert RIGHT not in " ".join(n.text for n in told)
        calibrated(publisher, 1.05)
        await passwords(tmp_path, RIGHT)
        await broker.stop()
        await broker.start()
        async with Subscriber(broker.client()) as station:
            assert b"1.05" in await station.payload("onboard/1/calibration")
            await station.payload("onboard/1/state")
            assert await station.payload("onboard/1/availability") == b"online"
        assert sum("it refuses" in n.text for n in told) == 1
        assert any(n.kind == "mqtt_lost" and "it refuses" not in n.text for n in told)


async def test_a_broker_that_remembers_gets_what_is_newer(tmp_path, publishing):
    kept = ("allow_anonymous true", "persistence true", f"persistence_location {tmp_path}/")
    async with Broker(tmp_path, *kept) as broker, publishing(broker.port) as publisher:
        calibrated(publisher, 1.01)
        async with Subscriber(broker.client()) as station:
            await station.payload("onboard/1/calibration")
        publisher._backoff.next = lambda: 1.0  # somebody who listens is there before
        await broker.stop(orderly=True)
        await until(lambda: not publisher.connected)
        calibrated(publisher, 1.05)
        await broker.start()
        async with Subscriber(broker.client()) as station:
            assert b"1.01" in await station.payload("onboard/1/calibration")
            await station.until(lambda: b"1.05" in station.latest["onboard/1/calibration"])
            await station.until(lambda: station.latest["onboard/1/availability"] == b"online")


async def test_commands_are_heard_again_after_it(tmp_path, publishing):
    actions = Obedient()
    async with (
        Broker(tmp_path) as broker,
        publishing(broker.port, actions=actions, commands=True) as publisher,
    ):
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_connected")
        await broker.stop()
        await until(lambda: not publisher.connected)
        await broker.start()
        await until(lambda: publisher.connected)
        async with Subscriber(broker.client()) as station:
            await station.client.publish("onboard/1/command", b"approve", qos=1)
            reply = json.loads(await station.payload("onboard/1/command/reply"))
        assert reply["done"] == "approved"
        assert actions.asked == [("approve", ())]


class Restarting(NoBroker):
    """In the place of aiomqtt's client: its line is cut once, and it is away for a while."""

    cut: asyncio.Event
    sent: ClassVar[list[tuple[str, bytes]]] = []

    async def publish(self, topic, payload, **_how):
        if self.cut.is_set() and asyncio.get_running_loop().time() < self.until:
            raise publisher_module.aiomqtt.MqttError("The client is not currently connected.")
        self.sent.append((topic, payload))

    async def _silence(self):
        await self.cut.wait()
        if asyncio.get_running_loop().time() < self.until:
            raise publisher_module.aiomqtt.MqttError("Disconnected during message iteration")
        await asyncio.Event().wait()
        yield


@virtual_time
async def test_an_hour_without_it_costs_no_more_memory_than_a_minute(monkeypatch, caplog):
    caplog.set_level(logging.INFO)
    loop = asyncio.get_running_loop()
    monkeypatch.setattr(publisher_module, "Client", Restarting)
    monkeypatch.setattr(Restarting, "cut", asyncio.Event(), raising=False)
    monkeypatch.setattr(Restarting, "sent", sent := [])
    publisher = Publisher(settings(), Obedient(), Notices(loop.time), clock=loop.time)
    task = asyncio.create_task(publisher.run())
    publisher.publish(snapshot())
    await asyncio.sleep(2 * limits.STABLE_S)
    monkeypatch.setattr(Restarting, "until", loop.time() + AWAY_S)
    Restarting.cut.set()
    await asyncio.sleep(0.1)
    sent.clear()
    events = 0
    while loop.time() < Restarting.until - 1.0:
        events += 1
        rolling = [journal_line(n) for n in range(max(0, events - 50), events)]
        publisher.publish(snapshot(time=events, journal=rolling))
        await asyncio.sleep(1.0)
    assert sent == []
    assert len(publisher._outbox._events) == limits.EVENTS_MAX
    for _ in range(120):
        publisher.publish(snapshot(time=events, journal=rolling))
        await asyncio.sleep(1.0)
    await publisher.close()
    await task
    texts = [json.loads(p)["text"] for topic, p in sent if topic.endswith("event")]
    assert texts == [f"write {n}" for n in range(events - limits.EVENTS_MAX, events)]
    _, gone, back = [r.getMessage() for r in caplog.records if "broker" in r.getMessage()]
    assert "lost" in gone
    assert f"without the oldest {events - limits.EVENTS_MAX} of its events" in back
