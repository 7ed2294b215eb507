"""What the service notices of the autopilot's parameters."""

import logging

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.daemon.pushing.parameters import NEEDED, ParameterWatch


@pytest.fixture
def watch():
    watching = ParameterWatch()
    watching.start(1, 1, 0.0)
    return watching


def told(name, value):
    """As the codec hands it over."""
    message = mavlink.MAVLink_param_value_message(name.encode(), value, 9, 1000, 65535)
    message.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=1))
    parser = mavlink.MAVLink(None)
    (read,) = parser.parse_buffer(bytes(message.get_msgbuf()))
    return read


def test_an_autopilots_statistics_fill_no_log(watch, caplog):
    """ArduPilot tells STAT_RUNTIME every half minute, pressures after each start."""
    with caplog.at_level(logging.INFO):
        for second in range(0, 3600, 30):
            watch.feed(told("STAT_RUNTIME", float(second)), float(second))
            watch.feed(told("BARO1_GND_PRESS", 95_000.0 + second), float(second))
        assert caplog.messages == []
        assert watch.counters["parameters_changed"] == 0
        watch.feed(told("INS_ACCOFFS_Y", 0.25), 3600.0)
        watch.feed(told("INS_ACCOFFS_Y", 0.625), 3601.0)
        watch.feed(told("AHRS_TRIM_X", 0.0), 3602.0)
        watch.feed(told("AHRS_TRIM_X", 0.01), 3603.0)
    assert caplog.messages == [
        "INS_ACCOFFS_Y changed from 0.25 to 0.625",
        "AHRS_TRIM_X changed from 0 to 0.01",
    ]
    assert watch.counters["parameters_changed"] == 2
    assert watch.values["STAT_RUNTIME"] == 3570.0


class Queueing:
    """Answers reads late, with the values of when they were asked, as ArduPilot does."""

    def __init__(self, values):
        self.values = values
        self.answers = []

    def hear(self, messages):
        for message in messages:
            if message.get_type() == "PARAM_REQUEST_READ":
                name = message.param_id
                if name in self.values:
                    self.answers.append((name, self.values[name]))

    def answer(self, watch, now):
        waiting, self.answers = self.answers, []
        for name, value in waiting:
            self.hear(watch.feed(told(name, value), now))


def test_an_answer_that_is_older_than_an_announcement_is_not_believed_for_long(watch):
    """Somebody sets a value, or a sensor says who it is, while its old one waits to be sent."""
    autopilot = Queueing(dict.fromkeys(NEEDED, 0.0))
    autopilot.hear(watch.poll(0.0))
    set_meanwhile = {name: 0.25 for name, _ in autopilot.answers}
    assert "INS_ACCOFFS_X" in set_meanwhile
    autopilot.values |= set_meanwhile
    for name, value in set_meanwhile.items():
        autopilot.hear(watch.feed(told(name, value), 0.3))
    for tick in range(100):
        autopilot.answer(watch, 0.4 + 0.02 * tick)
        autopilot.hear(watch.poll(0.4 + 0.02 * tick))
    assert watch.complete
    assert watch.values == autopilot.values


def test_what_changes_is_asked_for_once_each(watch):
    """A person who turns a knob causes a read at a time, not one for each step."""
    watch.poll(0.0)
    watch.feed(told("AHRS_TRIM_X", 0.0), 0.1)
    asked = [
        message
        for step in range(1, 100)
        for message in watch.feed(told("AHRS_TRIM_X", 0.001 * step), 0.1 + 0.001 * step)
        if message.get_type() == "PARAM_REQUEST_READ" and message.param_id == "AHRS_TRIM_X"
    ]
    assert len(asked) <= 50
