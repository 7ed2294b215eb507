from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from onboard.answers.match_document import match_document
from onboard.answers.match_files import settings_text
from onboard.cli.main import run
from onboard.cli.match import summary
from onboard.cli.terminal import Terminal
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.records import Aside, Compared, WindEstimate
from tests.recordings.dataflash_writer import modern_log
from tests.report.matches_by_hand import by_hand


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "short.BIN"
    path.write_bytes(bytes(modern_log(6)))
    return path


def failed(capsys) -> str:
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


def test_a_recording_of_which_nothing_can_be_said_is_one_line_and_status_2(log, capsys):
    assert run(["match", str(log)]) == 2
    assert "short.BIN" in failed(capsys)


def test_three_recordings_are_one_too_many(log, capsys):
    assert run(["match", str(log), str(log), str(log)]) == 2
    assert "match takes one recording" in failed(capsys)


def test_a_flight_that_is_set_aside_is_marked_in_the_document():
    two = WindEstimate(1.0, 0.0, 0.1, 0.1, 30.0)
    drag = Compared(17.0, 13.6, 0.1, "kg/m^2")
    made = by_hand(other_winds=(two, two), aside=(Aside(2, 0, "body_drag", "bcoef_x", drag, drag),))
    told = match_document(replace(made, others=(made.real, made.real)))
    assert [o.set_aside for o in told.others] == [False, True]


def test_another_flight_is_not_written_over(log, tmp_path, capsys):
    other = tmp_path / "other.BIN"
    other.write_bytes(log.read_bytes())
    assert run(["match", str(log), "--with", str(other), "--json", str(other)]) == 2
    assert "other.BIN" in failed(capsys)
    assert other.read_bytes() == log.read_bytes()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "no JSON"),
        ("[1]", "no JSON object"),
        ("[" * 100_000, "no JSON"),
        ("9" * 5000, "no JSON"),
        ('{"mass": "x"}', "mass"),
        ('{"mass": NaN}', "mass is too large"),
        ('{"mdrag_coef": -1e999}', "mdrag_coef is too large"),
        ('{"battCapacityAh": ' + "9" * 400 + "}", "battCapacityAh is too large"),
        ('{"mass": 0}', "mass must be positive"),
        ('{"refAngle": 120}', "nothing flies with these numbers"),
        ('{"refSpd": 1e-300}', "refSpd is too small"),
        ('{"mass": 1e30}', "mass is too large"),
        ('{"refAngle": 90.5, "mdrag_coef": 1}', "nothing flies with these numbers"),
        ('{"x": "' + "y" * 1_000_000 + '"}', "longer than"),
    ],
)
def test_a_frame_that_cannot_be_used_is_named(log, tmp_path, capsys, content, said):
    frame = tmp_path / "frame.json"
    frame.write_text(content)
    assert run(["match", str(log), "--frame", str(frame)]) == 2
    message = failed(capsys)
    assert said in message
    assert "frame.json" in message


def test_a_frame_that_has_no_end_is_not_read_to_it(log, capsys):
    assert run(["match", str(log), "--frame", "/dev/zero"]) == 2
    assert "longer than" in failed(capsys)


def test_a_name_with_an_end_of_a_line_sets_nothing():
    text = settings_text(by_hand("flight\nINS_ACCSCAL_X,9.9\r\u2028ARMING_CHECK,0 \u00e4.BIN"))
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    assert lines == ["SIM_WIND_SPD,5"]
    assert text.isascii()


@pytest.mark.recordings
@pytest.mark.slow
def test_a_flight_in_wind_with_another_frame_as_the_nominal_one(recordings, tmp_path, capsys):
    flight = recordings / "frames" / "e02.BIN"
    if not flight.exists():
        pytest.skip("no recordings of other airframes")
    frame, param, made, answer = (
        tmp_path / n for n in ("in.json", "s.param", "out.json", "a.json")
    )
    frame.write_text(json.dumps({"mdrag_coef": 0.4}))
    arguments = ["--frame", str(frame), "--param", str(param), "--frame-out", str(made)]
    assert run(["match", str(flight), *arguments, "--json", str(answer)]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    document = json.loads(answer.read_text())
    assert document["schema"] == "onboard.match/1"
    assert document["recordings"] == {"simulation": None, "real": "e02.BIN", "damage": []}
    # What differs from *this* frame: the drag, too.
    assert {e["name"] for e in document["effects"]} == {"wind", "rotor_drag", "body_drag"}
    assert document["wind"]["north"] == pytest.approx(-3.0, abs=0.15)
    assert document["wind"]["east"] == pytest.approx(5.196, abs=0.15)
    assert document["mismatch"]["x"]["after"] < 0.1
    assert document["settings"]["SIM_WIND_DIR"] == pytest.approx(300.0, abs=1.0)
    settings = dict(
        line.split(",") for line in param.read_text().splitlines() if not line.startswith("#")
    )
    assert float(settings["SIM_WIND_SPD"]) == pytest.approx(6.0, abs=0.1)
    found = CopterAirframe.of(json.loads(made.read_text()))
    assert found.mdrag_coef == pytest.approx(0.2, rel=0.05)


@pytest.mark.recordings
@pytest.mark.slow
def test_two_recordings_differ_only_in_what_differs(recordings, tmp_path):
    simulation, real = (recordings / "frames" / n for n in ("e03.BIN", "e11.BIN"))
    if not real.exists():
        pytest.skip("no recordings of other airframes")
    answer = tmp_path / "a.json"
    assert run(["match", str(simulation), str(real), "--json", str(answer)]) == 0
    document = json.loads(answer.read_text())
    assert document["recordings"] == {
        "simulation": "e03.BIN",
        "real": "e11.BIN",
        "damage": [],
    }
    found = {e["name"]: e for e in document["effects"]}
    assert set(found) == {"gps_latency", "rotor_drag", "body_drag"}
    value = found["rotor_drag"]["values"]["mcoef"]
    assert value["simulation"] == pytest.approx(0.559, rel=0.03)
    assert value["real"] == pytest.approx(0.497, rel=0.03)


def test_a_person_is_told_in_words_and_within_the_width_of_a_terminal(capsys):
    console = Terminal(highlight=False, width=80)
    for part in summary(by_hand(note="not used, too far from the model: 182-200 s")):
        console.print(part)
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    told = " ".join(out.split())
    assert "Moving air across the rotors brakes 2.0 times as much as in the simulation" in told
    assert "ahead (x) off by 1.987 -> 0.012 m/s^2 RMS" in told
    assert "velocity off by 7.89 -> 0.03 m/s after 10 s" in told
