from __future__ import annotations

import json
from pathlib import Path

import pytest

from onboard.cli.main import run
from tests.explained import replayed
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.telemetry_writer import px4_log, telemetry


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "short.BIN"
    path.write_bytes(bytes(modern_log(6)))
    return path


def test_a_short_log_gets_a_table_and_no_confident_numbers(log, capsys):
    assert run(["replay", str(log)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "Accelerometer 1" in out
    assert "Accelerometer 2" in out
    assert "calibrated\n" not in out
    assert max(map(len, out.splitlines())) <= 80


def test_the_help_shows_each_example_on_a_line_of_its_own(capsys):
    assert run(["replay", "--help"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert "onboard replay flight.BIN" in lines


def test_json_on_standard_output_is_alone_there(log, capsys):
    assert run(["replay", str(log), "--json", "-", "--imu", "2"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    document = json.loads(out)
    assert document["schema"] == "onboard.replay/1"
    assert document["recording"]["files"] == [str(log)]
    assert [imu["imu"] for imu in document["imus"]] == [2]
    assert document["imus"][0]["status"] in {"collecting", "insufficient", "invalid"}


def test_json_in_a_file_comes_with_the_table(log, tmp_path, capsys):
    assert run(["replay", str(log), "--json", str(tmp_path / "out.json")]) == 0
    assert "Accelerometer 1" in capsys.readouterr().out
    assert json.loads((tmp_path / "out.json").read_text())["recording"]["autopilot"] == "ardupilot"


def test_report_and_parameters_are_files_of_their_own(log, tmp_path, capsys):
    page, plain, tabbed = (tmp_path / name for name in ("r.html", "p.param", "p.params"))
    assert run(["replay", str(log), "--report", str(page), "--param", str(plain)]) == 0
    assert run(["replay", str(log), "--json", "-", "--param", str(tabbed)]) == 0
    assert capsys.readouterr().err == ""
    assert page.read_text().startswith("<!DOCTYPE html>")
    assert "accelerometer 1: insufficient" in plain.read_text()
    assert "INS_" not in tabbed.read_text()


def test_parameters_of_a_px4_that_says_too_little_are_all_comments(tmp_path, capsys):
    path, file = tmp_path / "x.ulg", tmp_path / "p.params"
    path.write_bytes(px4_log(5))
    assert run(["replay", str(path), "--param", str(file)]) == 0
    lines = file.read_text().splitlines()
    assert all(line.startswith("#") for line in lines)
    assert any("which CAL_ACCn" in line for line in lines)
    assert "INS_" not in file.read_text()


@pytest.mark.parametrize("name", ["x.tlog", "x.ulg"])
def test_other_kinds(tmp_path, capsys, name):
    path = tmp_path / name
    path.write_bytes(bytes(telemetry(5)) if name == "x.tlog" else px4_log(5))
    assert run(["replay", str(path), "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["recording"]["autopilot"] == ("ardupilot" if name == "x.tlog" else "px4")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["absent.BIN"], "absent.BIN: no such file"),
        ([], "LOG"),
        (["{log}", "--imu", "7"], "7"),
        (["{log}", "--imu", "3"], "no accelerometer 3"),
        (["{log}", "--json", "{log}/x.json"], "x.json"),
        (["{log}", "--report", "{log}/x.html"], "x.html"),
        (["{log}", "--param", "{log}/x.param"], "x.param"),
        (["{tmp}/text.tlog"], "text.tlog: not a"),
        (["{tmp}/empty.BIN"], "empty.BIN: is empty"),
        (["{tmp}"], "is a directory"),
    ],
)
def test_bad_input_is_one_line_and_status_2(log, tmp_path, capsys, arguments, said):
    (tmp_path / "text.tlog").write_text("this is no log\n" * 100)
    (tmp_path / "empty.BIN").touch()
    assert run(["replay", *(a.format(log=log, tmp=tmp_path) for a in arguments)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("onboard: ")
    assert err.count("\n") == 1
    assert said in err


def test_a_cut_log_is_read_and_the_damage_told(log, capsys):
    log.write_bytes(log.read_bytes()[:-30])
    assert run(["replay", str(log)]) == 0
    assert "cut off" in capsys.readouterr().out


@pytest.fixture(scope="module")
def c01(recordings):
    """One flight as its two recordings tell it, and its truth."""
    told = []
    for name in ("c01.tlog", "c01.BIN"):
        document = replayed(recordings / "sitl" / name).document()
        told.append(json.loads(document.to_json())["imus"])
    answers = json.loads((recordings / "sitl/answers.json").read_text())
    return told, answers["recordings"]["c01"]


@pytest.mark.slow
@pytest.mark.recordings
def test_a_recorded_flight_gives_the_truth_of_its_simulator(c01):
    (telemetry_imus, _), truth = c01
    imu = telemetry_imus[0]
    assert imu["status"] == "calibrated"
    assert imu["calibration"]["scale"] == pytest.approx(truth["scale"], abs=0.006)
    assert imu["calibration"]["offset"][:2] == pytest.approx(truth["offset"][:2], abs=0.012)
    assert imu["calibration"]["offset"][2] == pytest.approx(truth["offset"][2], abs=0.06)
    delay = imu["timing"]["gps_delay_s"]["value"]
    assert delay == pytest.approx(truth["net_gps_delay_s"], abs=0.015)


@pytest.mark.slow
@pytest.mark.recordings
def test_two_recordings_of_one_flight_agree(c01):
    numbers = [[i["calibration"]["scale"] + i["calibration"]["offset"] for i in x] for x in c01[0]]
    for imu in range(2):
        for k in range(6):
            limit = 0.003 if k < 3 else 0.03
            assert numbers[0][imu][k] == pytest.approx(numbers[1][imu][k], abs=limit)
