"""The parameter file: what a ground station would set, and nothing else."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.mavparm import MAVParmDict

from onboard.answers.advice import advise
from onboard.answers.answer import Answer
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import Status
from onboard.core.maths.accelerometer import parameter_names
from onboard.report.parameters import calibration_text, parameter_text
from tests.report.diagnoses_by_hand import (
    IN_FORCE,
    advice_on,
    calibration,
    diagnosis,
    effect,
    told_apart_not,
    unknown,
)

STATIONS = Path(__file__).resolve().parents[2] / "build" / "stations"
"""Where the loaders of other programs are, if they could be installed."""


def param_file(made, parameters=IN_FORCE, *, qgc: bool = False) -> str:
    return parameter_text(made, advice_on(made, parameters), qgc=qgc)


def loaded(text: str) -> dict[str, float]:
    """As ground stations read it: comments dropped, name and value split at the comma."""
    assert text.isascii()
    assert text.endswith("\n")
    out: dict[str, float] = {}
    for line in text.splitlines():
        if line.startswith("#"):
            continue
        name, value = line.split(",")
        assert 0 < len(name) <= 16
        assert name not in out
        out[name] = float(value)
    return out


def test_observable_numbers_and_cures_and_nothing_else():
    set_now = loaded(param_file(diagnosis()))
    scale, offset = (set_now.pop(f"INS_ACC{which}_Z") for which in ("SCAL", "OFFS"))
    # Of the z axis only the force in level flight is known: that is what both are set for.
    assert scale * (-9.8 - offset) == pytest.approx(1.002 * (-9.8 - 0.05), abs=0.002)
    assert set_now == pytest.approx(
        {
            "INS_ACCSCAL_X": 1.01234567,
            "INS_ACCSCAL_Y": 0.99,
            "INS_ACCOFFS_X": 0.2,
            "INS_ACCOFFS_Y": -0.1,
            "GPS1_DELAY_MS": 210.0,
        },
        rel=1e-6,
    )


def test_names_follow_the_accelerometer():
    d = diagnosis(imu=2, calibration=calibration(imu=2), effects=())
    assert "INS_ACC2SCAL_X" in loaded(param_file(d))


@pytest.mark.parametrize("status", [s for s in Status if s is not Status.CALIBRATED])
def test_an_incomplete_calibration_is_only_a_comment(status):
    text = param_file(diagnosis(calibration=calibration(status=status)))
    assert set(loaded(text)) == {"GPS1_DELAY_MS"}
    assert "INS_ACCSCAL_X" in text


def test_cures_of_effects_not_told_apart_are_only_comments():
    text = param_file(told_apart_not())
    assert "GPS1_DELAY_MS" not in loaded(text)
    assert "GPS1_DELAY_MS,210" in text


def test_nothing_to_load_from_a_flight_that_says_too_little():
    little = replace(calibration(), status=Status.INSUFFICIENT)
    silent = diagnosis(verdict=Verdict.INSUFFICIENT, calibration=little)
    assert loaded(param_file(silent)) == {}


def test_a_flight_too_dull_for_physics_may_show_numbers_all_the_same():
    dull = diagnosis(verdict=Verdict.INSUFFICIENT, effects=())
    names = set(loaded(param_file(dull)))
    assert names
    assert names <= set(parameter_names(1).six)


def test_values_that_are_not_finite_do_not_come():
    assert loaded(param_file(unknown())) == {}


def test_a_parameter_comes_once():
    twice = (effect(), effect("gps_smoothing", parameters={"GPS1_DELAY_MS": 5.0}))
    assert loaded(param_file(diagnosis(effects=twice)))["GPS1_DELAY_MS"] == 210.0


def test_qgroundcontrol_gets_tabs_and_the_types_that_the_autopilot_declares():
    text = param_file(diagnosis(), qgc=True)
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert rows
    assert all(len(row) == 5 and row[:2] == ["1", "1"] for row in rows)
    kinds = {row[2]: (row[3], row[4]) for row in rows}
    assert kinds["GPS1_DELAY_MS"] == ("210", "4")
    assert kinds["INS_ACCSCAL_X"][1] == "9"


def test_both_forms_hold_the_same_settings():
    plain = [x.split(",") for x in param_file(diagnosis()).splitlines() if x[0] != "#"]
    tabbed = [x.split("\t") for x in param_file(diagnosis(), qgc=True).splitlines() if x[0] != "#"]
    assert [(n, float(v)) for n, v in plain] == [(r[2], float(r[3])) for r in tabbed]


def test_a_replay_gives_what_was_observed_of_every_accelerometer():
    one = diagnosis()
    two = diagnosis(imu=2, calibration=calibration(imu=2, status=Status.INSUFFICIENT))
    given = [Answer(one), Answer(two)]
    text = calibration_text(given, advise(given, IN_FORCE), ["a.BIN"])
    assert set(loaded(text)) <= set(parameter_names(1).six)
    assert len(loaded(text)) == 6  # z scale and offset as one combination
    assert "not to be set: the calibration is 'insufficient'" in text
    assert "not set, not calibrated: INS_ACC2" in text


def test_mission_planner_reads_it_and_stops_at_no_line():
    """As its ParamFile does: a line with NOTE: is a dialogue, two words are a setting."""
    text = param_file(diagnosis())
    assert "NOTE:" not in text
    words = [re.split(r"[ ,\t]+", x) for x in text.splitlines() if not x.startswith("#")]
    assert all(len(pair) == 2 for pair in words)
    assert {name: float(value) for name, value in words} == loaded(text)


def test_mavproxys_own_loader_reads_it(tmp_path, capsys):
    path = tmp_path / "cure.param"
    path.write_text(param_file(diagnosis()), encoding="utf-8")
    station = MAVParmDict()
    assert station.load(str(path))
    assert dict(station) == loaded(path.read_text(encoding="utf-8"))
    assert "Unrecognised" not in capsys.readouterr().out


READ = """
import json, sys
sys.path.insert(0, sys.argv[1])
from ardupilot_methodic_configurator.data_model_par_dict import ParDict
print(json.dumps({name: one.value for name, one in ParDict.from_file(sys.argv[2]).items()}))
"""


def test_methodic_configurators_own_loader_reads_it(tmp_path):
    if not (STATIONS / "ardupilot_methodic_configurator").is_dir():
        pytest.skip("no MethodicConfigurator (tests/stations/requirements.lock)")
    path = tmp_path / "50_calibration.param"
    path.write_text(param_file(diagnosis()), encoding="utf-8")
    answer = subprocess.run(  # noqa: S603 - this Python
        [sys.executable, "-I", "-c", READ, str(STATIONS), str(path)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    settings = loaded(path.read_text(encoding="utf-8"))
    assert settings
    assert json.loads(answer) == settings
