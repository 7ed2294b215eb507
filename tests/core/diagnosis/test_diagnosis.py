"""Diagnosis of recordings with one concealed effect each, and of one that has none."""

import json

import pytest

from onboard.core.diagnosis.records import Verdict
from onboard.core.inputs.samples import ImuSample
from onboard.recordings.opening import open_recording
from tests.explained import explained

pytestmark = [pytest.mark.recordings, pytest.mark.slow]


@pytest.fixture(scope="module")
def answers(recordings):
    return json.loads((recordings / "sitl" / "answers.json").read_text())["recordings"]


def diagnosed(recordings, name):
    """What is said of a recording, and its first inertial sample, from which times count."""
    path = recordings / "sitl" / f"{name}.tlog"
    begun = next(s.t for s in open_recording(path).samples() if isinstance(s, ImuSample))
    return explained(path).diagnosis, begun


def truth_of(record, first_sample):
    """Unknowns of an answer by the keys of the diagnosis."""
    match record["name"]:
        case "gps_lever_arm":
            return dict(zip("xyz", record["xyz_m"], strict=True))
        case "temperature_drift":
            return dict(zip("xyz", record["per_kelvin"], strict=True))
        case "bias_step":
            return {
                "time": record["time_boot_s"] - first_sample,
                **dict(zip("xyz", record["step"], strict=True)),
            }
        case "cross_axis":
            return {"xy": 0.03, "xz": 0.0, "yx": 0.0, "yz": 0.0, "zx": 0.0, "zy": 0.02}
        case "scale_nonlinearity":
            return dict(zip("xyz", record["per_g"], strict=True))
        case "heading_error":
            return {"yaw": record["yaw_rad"]}
        case "imu_delay":
            return {"delay": record["delay_s"]}
        case "vibration_rectification":
            return dict(zip("xyz", record["coef"], strict=True))
    raise AssertionError(record)


@pytest.mark.parametrize("name", ["a03", "b04", "i01", "i02", "i03", "i04", "i05", "i06"])
def test_the_concealed_effect_is_named_and_measured(recordings, answers, name):
    got, first = diagnosed(recordings, name)
    (record,) = answers[name]["effects"]
    assert got.verdict is Verdict.EXPLAINED, got.note
    assert record["name"] in [e.name for e in got.effects]
    assert {e.name for e in got.effects} <= {record["name"]}
    (effect,) = got.effects
    for key, true in truth_of(record, first).items():
        quantity = effect.unknowns[key]
        limit = max(0.1 * abs(true), 3.0 * quantity.sigma)
        assert abs(quantity.value - true) < limit, (key, quantity, true)
    assert effect.held_out_after < effect.held_out_before


def test_a_clean_recording_comes_out_clean(recordings):
    got, _ = diagnosed(recordings, "a01")
    assert got.verdict is Verdict.CLEAN, [e.name for e in got.effects]
    assert got.effects == ()
