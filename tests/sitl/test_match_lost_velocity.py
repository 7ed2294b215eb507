"""A receiver that has no fix for most of a minute, in calm air: what is left is no air."""

import re

import pytest

from sitl import recording
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from tests.sitl.altered import matched

LOST = (50.0, 95.0)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What ``onboard match --json`` says of it."""
    spec = recording.FlightSpec(seed=6, duration=150.0, aircraft=Aircraft(craft=Airframe()))

    def without_fix(t, message):
        if message.get_type() == "GPS_RAW_INT" and LOST[0] < t < LOST[1]:
            message.fix_type = 1
        return True

    return matched(tmp_path_factory.mktemp("lost"), spec, without_fix)


def test_the_part_is_left_out_and_said(told):
    said = re.search(r"nobody knows the velocity for (\d+) s", told["note"])
    assert said
    # It is known for a while after the last fix, and before the first.
    assert 20.0 < float(said[1]) <= LOST[1] - LOST[0] + 2.0


def test_a_velocity_that_wanders_off_is_no_gust(told):
    assert {e["name"] for e in told["effects"]} <= {"gps_fault", "gps_latency", "gps_smoothing"}
    assert told["wind"]["turbulence_rms"] is None
