"""A flight as telemetry and as a laboratory's table: one answer."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.cli.main import run
from onboard.mavlink.decode import Decoder
from sitl import recording
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.messages import packed
from tests.recordings.table_writer import MAP, MOTORS, cells, moving, write_table

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A flight with heavy rotors in wind, as a .tlog and as a table."""
    folder = tmp_path_factory.mktemp("flight")
    aircraft = Aircraft(craft=Airframe().with_drag(mcoef=0.45), air=Air(north=3.0, east=-2.0))
    spec = recording.FlightSpec(seed=4, duration=130.0, aircraft=aircraft, attitude_errors=False)
    packer, decoder = mav.MAVLink(None, srcSystem=1, srcComponent=1), Decoder()
    rows = []
    with (folder / "flight.tlog").open("wb") as file:
        for unix_us, message in recording.run(spec).messages:
            file.write(struct.pack(">Q", unix_us) + packed(message, packer))
            if message.get_type() == "LOCAL_POSITION_NED":
                m = message
                rows.append(moving(m.time_boot_ms * 1e-3, (m.vx, m.vy, m.vz), (m.x, m.y, m.z)))
            rows += [(s.t or 0.0, cells(s)) for s in decoder.decode(message)]
    write_table(rows, folder / "flight.csv")
    origin = f"[origin]\naltitude = {spec.environment.altitude}\n"
    (folder / "map.toml").write_text(MAP + MOTORS + origin)
    return folder


def asked(folder, *arguments):
    answer = folder / "answer.json"
    assert run(["match", *map(str, arguments), "--json", str(answer)]) == 0
    return json.loads(answer.read_text())


def test_a_table_gives_the_answer_of_the_telemetry(flight):
    telemetry = asked(flight, flight / "flight.tlog")
    table = asked(flight, flight / "flight.csv", "--columns", flight / "map.toml")
    assert table["vehicle"] == "copter"
    of_one, of_other = ({e["name"]: e["values"] for e in d["effects"]} for d in (telemetry, table))
    # The table's velocity is no receiver's: it has no latency of one to tell of.
    assert set(of_one) == set(of_other) == {"wind", "rotor_drag"}
    for name, values in of_one.items():
        for key, value in values.items():
            other = of_other[name][key]
            sigma = np.hypot(value["sigma"], other["sigma"])
            assert abs(value["real"] - other["real"]) < 3.0 * sigma, (name, key)


def test_a_force_that_no_accelerometer_measured_has_no_sensor_to_blame(flight):
    derived = (flight / "map.toml").read_text().replace("[force]", "[force]\nderived = true")
    (flight / "derived.toml").write_text(derived)
    table = asked(flight, flight / "flight.csv", "--columns", flight / "derived.toml")
    assert {e["name"] for e in table["effects"]} == {"wind", "rotor_drag"}
    assert {e["level"] for e in table["effects"]} == {"vehicle"}
    assert not [name for name in table["settings"] if name.startswith("SIM_ACC")]


def test_a_table_without_a_map_is_refused(flight, capsys):
    assert run(["match", str(flight / "flight.csv")]) == 2
    assert "needs --columns" in capsys.readouterr().err
