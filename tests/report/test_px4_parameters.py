"""PX4's parameter file: with its values PX4 measures what the answer says that the force was."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.answers.advice import advise
from onboard.answers.answer import Answer
from onboard.answers.px4 import px4_advice, sensor_of
from onboard.cli.main import run
from onboard.core.estimate.result import Status
from onboard.core.maths.board_orientation import board_rotation
from onboard.recordings.ulog_information import ulog_information
from onboard.report.parameters import px4_text
from tests.recordings.telemetry_writer import px4_log, telemetry
from tests.report.diagnoses_by_hand import calibration, diagnosis

FLEW, OTHER = 3_211_018, 2_818_058
TRUSTED = {"observable": (True,) * 6, "in_force_scale": (1.0,) * 3, "in_force_offset": (0.0,) * 3}
IN_FORCE = {
    "CAL_ACC0_ID": OTHER, "CAL_ACC0_XOFF": 0.7,
    "CAL_ACC1_ID": FLEW, "CAL_ACC1_ROT": -1,
    "CAL_ACC1_XOFF": 0.11, "CAL_ACC1_YOFF": -0.2, "CAL_ACC1_ZOFF": 0.31,
    "CAL_ACC1_XSCALE": 0.99, "CAL_ACC1_YSCALE": 1.02, "CAL_ACC1_ZSCALE": 1.01,
    "SENS_BOARD_ROT": 2,
}  # fmt: skip


def log(tmp_path, changed=None, selected=(FLEW,)):
    path = tmp_path / "x.ulg"
    path.write_bytes(px4_log(2, IN_FORCE | (changed or {}), selected))
    return path


def answered(**changed):
    return Answer(diagnosis(calibration=calibration(parameters_known=False, **(TRUSTED | changed))))


def advised(path, answer, last=None):
    return px4_advice(answer, path, ulog_information(path).parameters | (last or {}))


def loaded(text):
    """As QGroundControl's ParameterManager reads it: tabs, five columns, comments left."""
    out = {}
    for line in text.splitlines():
        if line.startswith("#"):
            continue
        vehicle, component, name, value, kind = line.split("\t")
        assert (vehicle, component, kind) == ("1", "1", "9")
        assert name not in out
        out[name] = float(value)
    return out


def measured(raw, parameters, rotation):
    """What PX4 makes of raw samples, (n, 3)."""
    stem = "CAL_ACC1_"
    scale = np.array([parameters[f"{stem}{axis}SCALE"] for axis in "XYZ"])
    offset = np.array([parameters[f"{stem}{axis}OFF"] for axis in "XYZ"])
    return ((raw - offset) * scale) @ rotation.T


@pytest.mark.parametrize(("own", "board"), [(-1, 0), (-1, 2), (-1, 12), (4, 2), (28, 0), (24, 6)])
def test_with_the_file_loaded_px4_measures_what_the_answer_says(tmp_path, own, board):
    path = log(tmp_path, {"CAL_ACC1_ROT": own, "SENS_BOARD_ROT": board})
    answer = answered()
    its = advised(path, answer)
    assert its.reasons == ()
    new = IN_FORCE | loaded(px4_text([answer], [its], ["x.ulg"]))
    assert set(new) == set(IN_FORCE)
    rotation = board_rotation(own if own >= 0 else board)
    raw = np.random.default_rng(4).normal(0.0, 10.0, (50, 3))
    six = advise((answer,), {})[0].plan.six_wanted()  # against what PX4 had measured
    wanted = (measured(raw, IN_FORCE, rotation) - np.array(six.offset)) * np.array(six.scale)
    assert measured(raw, new, rotation) == pytest.approx(wanted, abs=2e-5)  # seven digits


@pytest.mark.parametrize(
    ("changed", "selected", "said"),
    [
        ({}, (FLEW, OTHER), "changed from one accelerometer"),
        ({}, (), "does not say which"),
        ({}, (77,), "does not say which"),
        ({"SENS_BOARD_ROT": 1}, (FLEW,), "multiples of 90 degrees"),
        ({"SENS_BOARD_Y_OFF": 0.5}, (FLEW,), "multiples of 90 degrees"),
    ],
)
def test_a_sensor_that_is_not_known_for_certain_gets_nothing(tmp_path, changed, selected, said):
    path = log(tmp_path, changed, selected)
    its = advised(path, answered())
    assert its.settings == ()
    assert said in " ".join(its.reasons)


def test_the_only_one_that_is_calibrated_is_the_one_that_flew(tmp_path):
    path = log(tmp_path, {"CAL_ACC0_ID": 0}, ())
    assert sensor_of(path, {}).number == 1


def test_values_that_px4_changed_meanwhile_are_no_basis(tmp_path):
    its = advised(log(tmp_path), answered(), {"CAL_ACC1_ZOFF": 0.4})
    assert "CAL_ACC1_ZOFF" in " ".join(its.reasons)
    assert its.settings == ()


@pytest.mark.parametrize(
    "changed", [{"status": Status.INSUFFICIENT}, {"held_out_after": 3.0, "predictive_gain": -10.0}]
)
def test_what_is_not_proven_is_a_comment(tmp_path, changed):
    answer = answered(**changed)
    its = advised(log(tmp_path), answer)
    assert its.reasons
    text = px4_text([answer], [its], ["x.ulg"])
    assert loaded(text) == {}
    assert text.isascii()


def test_of_several_recordings_none_is_the_basis(tmp_path):
    path = log(tmp_path)
    its = px4_advice(answered(), path, ulog_information(path).parameters, alone=False)
    assert its.settings == ()
    assert its.reasons


def test_telemetry_of_px4_does_not_say_what_px4_did_to_the_sensor(tmp_path, capsys):
    path = tmp_path / "x.tlog"
    path.write_bytes(bytes(telemetry(5, firmware=12)))
    assert run(["replay", str(path), "--param", str(tmp_path / "p.params")]) == 2
    assert "no ULog of PX4" in capsys.readouterr().err
