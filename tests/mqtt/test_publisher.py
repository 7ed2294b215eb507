"""Against a real broker: topics, retained state, restarts, refusals, commands."""

import asyncio
import gc
import json
import tracemalloc

import aiomqtt
import pytest

from onboard.daemon.mqtt.publisher import _reason
from onboard.daemon.view.snapshot import Snapshot
from tests.mqtt.broker import Broker, Subscriber, free_port
from tests.mqtt.published import Obedient, imu_view, journal_line, kinds, snapshot

DIAGNOSIS = {"schema": "onboard.explain/1", "verdict": "clean", "effects": []}


async def until_counted(publisher, name, count):
    async with asyncio.timeout(60.0):
        while publisher.counters[name] < count:
            await asyncio.sleep(0.01)


async def test_everything_retained_is_there_for_whoever_comes_late(broker, publishing):
    async with publishing(broker.port) as publisher:
        publisher.publish(snapshot(diagnosis=DIAGNOSIS))
        await kinds(publisher, "mqtt_connected")
        async with Subscriber(broker.client()) as early:
            for topic in ("availability", "state", "calibration", "diagnosis"):
                await early.payload(f"onboard/1/{topic}")
        async with Subscriber(broker.client()) as late:
            assert await late.payload("onboard/1/availability") == b"online"
            state = Snapshot.from_json(await late.payload("onboard/1/state"))
            assert state == snapshot(diagnosis=DIAGNOSIS)
            calibration = json.loads(await late.payload("onboard/1/calibration"))
            assert calibration["imus"][0]["calibration"]["scale"] == [1.02, 0.99, None]
            assert json.loads(await late.payload("onboard/1/diagnosis")) == DIAGNOSIS
            assert all(m.retain for m in late.messages)


async def test_only_what_changed_is_sent_and_every_event_once_in_order(broker, publishing):
    lines = [journal_line(n) for n in range(6)]
    async with Subscriber(broker.client()) as station, publishing(broker.port) as publisher:
        publisher.publish(snapshot(journal=lines[:2]))
        for end in (2, 3, 3, 6):
            publisher.publish(snapshot(journal=lines[:end]))
        await station.until(lambda: len(station.all("onboard/1/event")) == 4)
        publisher.publish(snapshot(imus=[imu_view(scale=1.03)], journal=lines))
        await station.until(lambda: len(station.all("onboard/1/calibration")) == 2)
        texts = [json.loads(p)["text"] for p in station.all("onboard/1/event")]
        assert texts == ["write 2", "write 3", "write 4", "write 5"]
        assert not any(m.retain for m in station.messages if str(m.topic).endswith("event"))


async def test_a_broker_that_forgot_everything_has_it_back(tmp_path, publishing, monkeypatch):
    # However slow the machine is, these connections are short ones.
    monkeypatch.setattr("onboard.daemon.mqtt.limits.STABLE_S", 600.0)
    async with Broker(tmp_path) as broker, publishing(broker.port) as publisher:
        publisher.publish(snapshot(diagnosis=DIAGNOSIS))
        await kinds(publisher, "mqtt_connected")
        for restart in range(3):
            await broker.stop()
            lost = restart + 1
            async with asyncio.timeout(60.0):
                while publisher.connected:
                    await asyncio.sleep(0.01)
            publisher.publish(
                snapshot(
                    time=2e9 + restart,
                    diagnosis=DIAGNOSIS,
                    journal=[journal_line(n) for n in range(lost)],
                )
            )
            await asyncio.sleep(0.11)  # the state's own interval
            publisher.publish(
                snapshot(
                    time=2e9 + restart,
                    diagnosis=DIAGNOSIS,
                    journal=[journal_line(n) for n in range(lost)],
                )
            )
            await broker.start()
            async with Subscriber(broker.client()) as station:
                assert await station.payload("onboard/1/availability") == b"online"
                state = Snapshot.from_json(await station.payload("onboard/1/state"))
                assert state.time == 2e9 + restart
                await station.payload("onboard/1/calibration")
                await station.payload("onboard/1/diagnosis")
        # A broker that comes and goes within seconds is one outage, told of once.
        assert sum(n.kind == "mqtt_lost" for n in publisher.kept) == 1


@pytest.mark.parametrize(
    "error",
    [
        aiomqtt.MqttError("Disconnected during message iteration"),
        aiomqtt.MqttCodeError(4),  # found while something was published
        aiomqtt.MqttCodeError(7),
    ],
)
def test_a_lost_connection_is_one_reason_whatever_was_under_way(error):
    assert _reason(error) == "the connection was lost"


async def test_events_of_an_outage_come_after_it(tmp_path, publishing):
    async with Broker(tmp_path) as broker, publishing(broker.port) as publisher:
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_connected")
        await broker.stop()
        await kinds(publisher, "mqtt_lost")
        publisher.publish(snapshot(journal=[journal_line(1), journal_line(2)]))
        await broker.start()
        # Nobody retains events: a subscriber with a session of its own would have them; here
        # the broker's log tells that they came.
        async with asyncio.timeout(60.0):
            while broker.log.count("'onboard/1/event'") < 2:
                await asyncio.sleep(0.02)


async def test_an_absent_broker_is_told_of_once_and_tried_again(tmp_path, publishing):
    port = free_port()
    async with publishing(port) as publisher:
        publisher.publish(snapshot())
        async with asyncio.timeout(60.0):
            while publisher.counters["mqtt_attempts"] < 5:
                await asyncio.sleep(0.01)
        (lost,) = [n for n in publisher.kept if n.kind == "mqtt_lost"]
        assert lost.warning
        assert f"127.0.0.1:{port}" in lost.text
        assert "refused" in lost.text.lower()
        assert not publisher.connected


async def test_a_broker_that_hangs_is_left_and_found_again(tmp_path, publishing, monkeypatch):
    monkeypatch.setattr("onboard.daemon.mqtt.limits.ANSWER_S", 1.5)
    async with Broker(tmp_path) as broker, publishing(broker.port) as publisher:
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_connected")
        broker.freeze()
        publisher.publish(snapshot(imus=[imu_view(scale=1.05)]))
        (lost,) = await kinds(publisher, "mqtt_lost")
        assert "timed out" in lost.text
        broker.thaw()
        async with Subscriber(broker.client()) as station:
            await station.until(
                lambda: (
                    b"1.05" in station.latest.get("onboard/1/calibration", b"")
                    and station.latest.get("onboard/1/availability") == b"online"
                )
            )


async def test_farewell_and_last_will(broker, publishing):
    async with Subscriber(broker.client()) as station:
        async with publishing(broker.port) as publisher:
            publisher.publish(snapshot())
            await station.until(lambda: station.latest.get("onboard/1/availability") == b"online")
        await station.until(lambda: station.latest["onboard/1/availability"] == b"offline")
        assert station.all("onboard/1/availability") == [b"online", b"offline"]
    async with Subscriber(broker.client()) as late:
        assert await late.payload("onboard/1/availability") == b"offline"


async def test_a_publisher_that_dies_is_declared_offline_by_the_broker(broker, publishing):
    async with Subscriber(broker.client()) as station, publishing(broker.port) as publisher:
        publisher.publish(snapshot())
        await station.until(lambda: station.latest.get("onboard/1/availability") == b"online")
        # Somebody else takes our client id: the broker drops our connection without a farewell.
        async with broker.client(identifier="onboard-1"):
            await station.until(lambda: b"offline" in station.all("onboard/1/availability"))
        # And we come back.
        await station.until(lambda: station.all("onboard/1/availability")[-1] == b"online")


async def test_commands_are_carried_out_once_and_answered(broker, publishing):
    obedient = Obedient()
    async with (
        Subscriber(broker.client()) as station,
        publishing(broker.port, commands=True, actions=obedient) as publisher,
    ):
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_connected")
        replies = "onboard/1/command/reply"
        for number, (payload, expected) in enumerate(
            [
                (b'{"command": "approve", "imus": [1, 2], "id": "a"}', ("done", "approved")),
                (b"rollback", ("done", "rolling back")),
                (b'{"command": "reset"}', ("error", "not while armed")),
                (b'{"command": "format"}', ("error", "format")),
                (b'{"command": "approve", "imus": [9]}', ("error", "<= 5")),
                (b'{"command": "approve", "imu": 1}', ("error", "imu")),
                (b"\xff\x00", ("error", "")),
                (b" " * 5000, ("error", "at most")),
            ]
        ):
            await station.client.publish("onboard/1/command", payload, qos=1)
            await station.until(lambda count=number + 1: len(station.all(replies)) == count)
            reply = json.loads(station.all(replies)[-1])
            outcome, text = expected
            assert text in reply[outcome]
            assert reply["id"] == ("a" if number == 0 else None)
        assert obedient.asked == [("approve", (1, 2)), ("rollback", ())]


async def test_a_retained_command_is_nobodys_wish(broker, publishing):
    obedient = Obedient()
    async with Subscriber(broker.client()) as station:
        await station.client.publish("onboard/1/command", b"rollback", qos=1, retain=True)
        async with publishing(broker.port, commands=True, actions=obedient) as publisher:
            publisher.publish(snapshot())
            await kinds(publisher, "mqtt_connected")
            async with asyncio.timeout(60.0):
                while not publisher.counters["mqtt_commands_ignored"]:
                    await asyncio.sleep(0.01)
    assert obedient.asked == []


async def test_a_command_without_end_takes_no_memory(broker, publishing, monkeypatch, caplog):
    """The library would have all of it, 256 MB at the most, before its length is looked at."""
    monkeypatch.setattr("onboard.daemon.mqtt.limits.DEAF_S", 3.0)
    size = 20_000_000
    topic = "onboard/1/command"
    async with Subscriber(broker.client()) as station:
        await station.client.publish(topic, bytes(size), qos=1, retain=True)
    async with publishing(broker.port, commands=True) as publisher:
        tracemalloc.start()
        try:
            publisher.publish(snapshot())
            await until_counted(publisher, "mqtt_commands_refused", 2)
            assert tracemalloc.get_traced_memory()[1] < size / 4
        finally:
            tracemalloc.stop()
        async with Subscriber(broker.client()) as station:
            # Everything else goes on meanwhile.
            assert b"onboard.state" in await station.payload("onboard/1/state")
            await station.client.publish(topic, b"", qos=1, retain=True)
            while "onboard/1/command/reply" not in station.latest:
                await station.client.publish(topic, b"approve", qos=1)
                await asyncio.sleep(0.2)
            assert b"approved" in station.latest["onboard/1/command/reply"]
        assert len(await kinds(publisher, "mqtt_command_too_long")) == 1
    gc.collect()
    assert not [r for r in caplog.records if r.name == "asyncio" and r.levelname == "ERROR"]


async def test_commands_are_off_by_default(broker, publishing):
    obedient = Obedient()
    async with (
        Subscriber(broker.client()) as station,
        publishing(broker.port, actions=obedient) as publisher,
    ):
        publisher.publish(snapshot())
        await kinds(publisher, "mqtt_connected")
        await station.client.publish("onboard/1/command", b"approve", qos=1)
        publisher.publish(snapshot(imus=[imu_view(2)]))
        await station.until(lambda: len(station.all("onboard/1/calibration")) == 2)
        assert obedient.asked == []
        assert "SUBSCRIBE from onboard-1" not in broker.log


async def test_a_prefix_of_ones_own_needs_no_vehicle(broker, publishing):
    async with (
        Subscriber(broker.client()) as station,
        publishing(broker.port, prefix="fleet/kite/") as publisher,
    ):
        publisher.publish(snapshot(system_id=None))
        await station.payload("fleet/kite/state")


async def test_the_place_follows_the_vehicle(broker, publishing):
    """Somebody was taken for the vehicle before the vehicle was there."""
    async with Subscriber(broker.client()) as station:
        async with publishing(broker.port, commands=True, discovery="house") as publisher:
            publisher.publish(snapshot(system_id=42))
            await station.until(lambda: "onboard/42/state" in station.latest)
            await station.payload("house/device/onboard-42/config")
            publisher.publish(snapshot(system_id=None))
            publisher.publish(snapshot(system_id=1))
            await station.until(lambda: station.latest["onboard/42/availability"] == b"offline")
            await station.until(lambda: "onboard/1/state" in station.latest)
            publisher.publish(snapshot(system_id=1))
            await station.until(lambda: "house/device/onboard-1/config" in station.latest)
            await station.until(lambda: station.latest["house/device/onboard-42/config"] == b"")
            assert station.latest["onboard/1/availability"] == b"online"
            await station.client.publish("onboard/42/command", b"approve", qos=1)
            await station.client.publish("onboard/1/command", b"approve", qos=1)
            await station.payload("onboard/1/command/reply")
        assert "onboard/42/command/reply" not in station.latest
        assert station.latest["onboard/42/availability"] == b"offline"


async def test_a_given_prefix_stays_whatever_the_vehicle(broker, publishing):
    async with Subscriber(broker.client()) as station:
        async with publishing(broker.port, prefix="fleet/kite") as publisher:
            for system in (42, 1):
                publisher.publish(snapshot(system_id=system))
            await station.until(lambda: "fleet/kite/state" in station.latest)
        assert not any("/42/" in topic or "/1/" in topic for topic in station.latest)
        assert publisher.counters["mqtt_connects"] == 1


async def test_without_a_vehicle_there_is_no_prefix_and_no_connection(broker, publishing):
    async with publishing(broker.port) as publisher:
        publisher.publish(snapshot(system_id=None))
        assert publisher.prefix == ""
        assert publisher.counters["mqtt_attempts"] == 0
        publisher.publish(snapshot(system_id=7))
        await kinds(publisher, "mqtt_connected")
        assert publisher.prefix == "onboard/7"


@pytest.mark.parametrize("password", ["right", "wrong"])
async def test_user_and_password(tmp_path, publishing, password):
    table = tmp_path / "passwords"
    table.write_text("daemon:right\n")
    table.chmod(0o600)
    secret = tmp_path / "secret"
    secret.write_text(f"{password}\n")
    secret.chmod(0o600)
    await hashed(table)
    async with (
        Broker(tmp_path, "allow_anonymous false", f"password_file {table}") as broker,
        publishing(broker.port, username="daemon", password_file=str(secret)) as publisher,
    ):
        publisher.publish(snapshot())
        if password == "right":
            await kinds(publisher, "mqtt_connected")
        else:
            (lost,) = await kinds(publisher, "mqtt_lost")
            assert "authori" in lost.text.lower()


async def hashed(table):
    """Mosquitto's own tool turns the plain passwords into hashes."""
    process = await asyncio.create_subprocess_exec("mosquitto_passwd", "-U", str(table))
    assert await process.wait() == 0
