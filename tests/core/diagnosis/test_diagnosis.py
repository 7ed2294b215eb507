"""Diagnosis of recordings with one concealed effect each, and of one that has none."""

import json

import pytest

from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.recordings.opening import open_recording

pytestmark = pytest.mark.recordings


@pytest.fixture(scope="module")
def answers(recordings):
    return json.loads((recordings / "sitl" / "answers.json").read_text())["recordings"]


def diagnosed(recordings, name):
    made = Calibrator(CalibratorSettings(buffer_s=3600.0, refine=False))
    for sample in open_recording(recordings / "sitl" / f"{name}.tlog").samples():
        made.feed(sample)
    made.finish()
    return diagnose(made, 1), made.first_sample


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
        case "imu_delay":
            return {"delay": record["delay_s"]}
    raise AssertionError(record)


@pytest.mark.parametrize("name", ["a03", "b04", "i01", "i03", "i04"])
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
    got, _ = diagnosed(recordings, "a05")
    assert got.verdict is Verdict.CLEAN, [e.name for e in got.effects]
    assert got.effects == ()
