"""A receiver that has no fix for most of a minute, in calm air: what is left is no air."""

import json
import re
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.cli.main import run
from sitl import recording
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.messages import packed

LOST = (50.0, 95.0)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What ``onboard match --json`` says of it."""
    folder = tmp_path_factory.mktemp("lost")
    spec = recording.FlightSpec(seed=6, duration=150.0, aircraft=Aircraft(craft=Airframe()))
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    log, answer = folder / "flight.tlog", folder / "answer.json"
    with log.open("wb") as file:
        for unix_us, message in recording.run(spec).messages:
            t = 1e-6 * (unix_us - spec.start_unix_us)
            if message.get_type() == "GPS_RAW_INT" and LOST[0] < t < LOST[1]:
                message.fix_type = 1
            file.write(struct.pack(">Q", unix_us) + packed(message, packer))
    assert run(["match", str(log), "--json", str(answer)]) == 0
    return json.loads(answer.read_text())


def test_the_part_is_left_out_and_said(told):
    said = re.search(r"nobody knows the velocity for (\d+) s", told["note"])
    assert said
    # It is known for a while after the last fix, and before the first.
    assert 20.0 < float(said[1]) <= LOST[1] - LOST[0] + 2.0


def test_a_velocity_that_wanders_off_is_no_gust(told):
    assert {e["name"] for e in told["effects"]} <= {"gps_fault", "gps_latency", "gps_smoothing"}
    assert told["wind"]["turbulence_rms"] is None
