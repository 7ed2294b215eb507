"""The whole daemon with a real broker: what it sends fits the schema, and it obeys."""

import asyncio
import json

import jsonschema
import pytest

from onboard.daemon.mqtt import schema
from tests.daemon.daemons import calibration, convinced, hurried, running, until
from tests.daemon.standing_vehicle import Vehicle
from tests.mqtt.broker import Broker, Subscriber, free_port

TOPICS = ("state", "calibration", "event", "availability", "command/reply")


@pytest.fixture(autouse=True)
def hurry(monkeypatch):
    hurried(monkeypatch)


def configuration(tmp_path, port, broker_port, **mqtt):
    return {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"]},
        "push": {"approval": True, "disarmed_s": 2.0},
        "state": {"directory": str(tmp_path / "state")},
        "http": {"enabled": False},
        "mqtt": {"enabled": True, "port": broker_port, "state_interval_s": 0.1} | mqtt,
    }


def check(topic, payload):
    document = json.loads(payload) if topic != "availability" else payload.decode()
    jsonschema.Draft202012Validator(json.loads(schema.FILE.read_text())).validate({topic: document})


async def test_a_push_approved_over_the_broker(tmp_path, broker):
    port = free_port()
    async with Subscriber(broker.client()) as station:
        async with (
            running(configuration(tmp_path, port, broker.port, commands=True)) as service,
            Vehicle(port) as vehicle,
        ):
            convinced(service, calibration(1))
            await station.until(
                lambda: (
                    json.loads(station.latest.get("onboard/1/state", b"{}"))
                    .get("push", {})
                    .get("approval_needed")
                )
            )
            assert vehicle.sets == []
            await station.client.publish("onboard/1/command", b'{"command": "approve"}', qos=1)
            reply = json.loads(await station.payload("onboard/1/command/reply"))
            assert "approved" in reply["done"]
            await until(lambda: service.snapshot().push.can_roll_back == (1,))
            await station.until(
                lambda: any(b"completed" in event for event in station.all("onboard/1/event"))
            )
        await station.until(lambda: station.latest["onboard/1/availability"] == b"offline")
        # What was retained last is what was true last.
        state = json.loads(station.latest["onboard/1/state"])
        assert state["phase"] == "stopping"
        assert state["parameters"]["INS_ACCSCAL_X"] == pytest.approx(1.02)
        kinds = [json.loads(event)["kind"] for event in station.all("onboard/1/event")]
        assert kinds[:2] == ["found", "planned"], "diagnosed first, then written"
        for topic in TOPICS:
            payloads = station.all(f"onboard/1/{topic}")
            assert payloads, topic
            for payload in payloads:
                check(topic, payload)


async def test_an_absent_broker_changes_nothing_for_the_vehicle(tmp_path):
    port = free_port()
    document = configuration(tmp_path, port, free_port())
    document["push"]["approval"] = False
    async with running(document) as service, Vehicle(port):
        convinced(service, calibration(1))
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        await until(lambda: service.snapshot().counters.get("mqtt_failures", 0) >= 2)
        assert sum(n.kind == "mqtt_lost" for n in service.snapshot().notices) == 1


async def test_a_broker_that_comes_late_gets_everything(tmp_path):
    port = free_port()
    broker = Broker(tmp_path)
    async with (
        running(configuration(tmp_path, port, broker.port)) as service,
        Vehicle(port),
    ):
        convinced(service, calibration(1))
        await until(lambda: service.snapshot().counters.get("mqtt_failures", 0) >= 1)
        try:
            await broker.start()
            async with Subscriber(broker.client()) as station:
                assert await station.payload("onboard/1/availability") == b"online"
                await station.until(
                    lambda: json.loads(station.latest.get("onboard/1/calibration", b"{}")).get(
                        "imus"
                    )
                )
            async with asyncio.timeout(30.0):
                while not service.snapshot().counters.get("mqtt_connects"):
                    await asyncio.sleep(0.02)
        finally:
            await broker.stop()


async def test_missing_physics_is_retained_for_everybody_who_comes_later(tmp_path, broker):
    port = free_port()
    async with running(configuration(tmp_path, port, broker.port)) as service, Vehicle(port):
        why = "the GPS antenna is elsewhere (gps_lever_arm)"
        convinced(service, calibration(1), missing=why, effects=("gps_lever_arm",))
        await until(lambda: service.snapshot().diagnosis)
        async with Subscriber(broker.client()) as late:
            await late.until(
                lambda: (
                    b"gps_lever_arm" in late.latest.get("onboard/1/diagnosis", b"")
                    and "onboard/1/state" in late.latest
                )
            )
            await late.until(
                lambda: any(
                    why in proposal["held_back"].get("physics_missing", "")
                    for proposal in json.loads(late.latest["onboard/1/state"])["push"]["proposals"]
                )
            )
