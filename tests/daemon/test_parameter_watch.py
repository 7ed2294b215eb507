"""What the service notices of the autopilot's parameters."""

import logging

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.daemon.pushing.parameters import ParameterWatch


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
