"""The summary says what is gravest, and Home Assistant finds in it what it was told to show."""

import json
import re

import jinja2
import msgspec
import pytest

from onboard.daemon.mqtt.home_assistant import LONGEST, discovery_message, discovery_topic
from onboard.daemon.mqtt.summary import GRAVITY, summary, summary_message
from onboard.daemon.view.snapshot import StateView, StepView
from tests.mqtt.broker import Subscriber
from tests.mqtt.published import imu_view, snapshot


def imu(number, severity, percent=80.0):
    view = imu_view(number)
    coverage = msgspec.structs.replace(view.coverage, percent=percent)
    state = StateView(name=f"s{number}", title=severity, sentence="", severity=severity)
    return msgspec.structs.replace(view, state=state, coverage=coverage)


@pytest.mark.parametrize("gravest", GRAVITY)
def test_the_gravest_accelerometer_speaks_for_all(gravest):
    there = GRAVITY[: GRAVITY.index(gravest) + 1]
    said = summary(snapshot(imus=[imu(n, s) for n, s in enumerate(there, start=1)]))
    assert (said.severity, said.state) == (gravest, f"s{len(there)}")
    assert [i.severity for i in said.imus] == list(there)


def test_before_there_is_an_accelerometer_it_is_about_the_link():
    said = summary(snapshot(imus=[], system_id=None))
    assert (said.state, said.severity, said.next) == ("present", "info", "")


def test_it_stays_small_with_all_that_a_vehicle_can_have():
    everything = snapshot(imus=[imu(n, "warning", 99.6) for n in range(1, 6)])
    payload = summary_message(everything)
    assert len(payload) < 0.2 * len(everything.to_json())
    assert json.loads(payload)["imus"][4]["percent"] == 100


def shown(now, prefix="onboard/1"):
    """What Home Assistant shows of each entity: its own templates on the summary as it is sent."""
    told = json.loads(discovery_message(prefix, now))
    value = json.loads(summary_message(now))
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=False)  # noqa: S701
    return {
        name: environment.from_string(component["value_template"]).render(value_json=value)
        for name, component in told["components"].items()
    }


def test_every_template_finds_its_value():
    step = StepView(imu=1, text="turn " * 100, severity="info")
    now = msgspec.structs.replace(
        snapshot(imus=[imu(1, "good", 40.0), imu(3, "error", 70.0)]), next_step=step
    )
    said = shown(now)
    assert said["state"] == "error"
    assert said["problem"] == said["gps"] == "ON"
    assert said["approval"] == "OFF"
    assert (said["imu_1"], said["imu_3"]) == ("40", "70")
    assert len(said["next"]) == LONGEST
    assert shown(snapshot(imus=[imu(1, "good")]))["problem"] == "OFF"


def test_entities_are_of_one_device_read_only_and_told_apart():
    told = json.loads(discovery_message("fleet/kite 7", snapshot()))
    components = told["components"].values()
    assert told["device"]["identifiers"] == ["fleet-kite-7"]
    assert len({c["unique_id"] for c in components}) == len(components)
    assert {c["state_topic"] for c in components} == {"fleet/kite 7/summary"}
    assert {c["availability_topic"] for c in components} == {"fleet/kite 7/availability"}
    assert not any("command" in key for c in components for key in c)
    topic = discovery_topic("homeassistant/", "fleet/kite 7")
    assert re.fullmatch(r"homeassistant/device/[A-Za-z0-9_-]+/config", topic)


async def test_both_are_retained_for_whoever_comes_late(broker, publishing):
    async with publishing(broker.port, discovery="homeassistant") as publisher:
        publisher.publish(snapshot())
        async with Subscriber(broker.client()) as early:
            await early.payload("onboard/1/summary")
        async with Subscriber(broker.client()) as late:
            assert json.loads(await late.payload("onboard/1/summary"))["title"] == "up to date"
            found = await late.payload("homeassistant/device/onboard-1/config")
            assert found == discovery_message("onboard/1", snapshot())
            assert all(m.retain for m in late.messages)


async def test_without_the_setting_nothing_is_announced(broker, publishing):
    async with publishing(broker.port) as publisher, Subscriber(broker.client()) as station:
        publisher.publish(snapshot())
        await station.payload("onboard/1/summary")
        await station.payload("onboard/1/calibration")
        assert not any(str(m.topic).startswith("homeassistant") for m in station.messages)
