from __future__ import annotations

import json
from dataclasses import replace

import pytest

from onboard.answers.replay_document import (
    PushedDocument,
    RecordingDocument,
    ReplayDocument,
    imu_document,
)
from onboard.core.maths.accelerometer import SixParameters
from tests.cli.results import CALIBRATED, NOTHING_KNOWN

RECORDING = RecordingDocument(
    files=["x.tlog"], autopilot="ardupilot", duration_s=300.2, samples={"imu 1": 9, "gps": 2}
)


def written(*imus: object) -> dict:
    text = ReplayDocument(recording=RECORDING, imus=list(imus)).to_json().decode()
    assert text.endswith("}\n")
    assert "NaN" not in text
    assert "Infinity" not in text
    return json.loads(text)


def test_the_contract_of_replay():
    document = written(imu_document(CALIBRATED))
    assert next(iter(document)) == "schema"
    assert document["schema"] == "onboard.replay/1"
    assert document["recording"]["files"] == ["x.tlog"]
    assert document["recording"]["autopilot"] == "ardupilot"
    assert document["recording"]["duration_s"] == 300.2
    (imu,) = document["imus"]
    assert (imu["imu"], imu["status"], imu["trusted_s"]) == (1, "calibrated", 251.0)
    calibration = imu["calibration"]
    assert calibration["scale"] == [1.024, 0.987, 1.011]
    assert calibration["offset_sigma"] == [0.004, 0.005, 0.274]
    assert calibration["known"] == ["yes", "yes", "together", "yes", "yes", "together"]
    assert calibration["worth"]["directions"] == 5
    assert calibration["observable"] == [True, True, False, True, True, False]
    assert calibration["parameters"]["INS_ACCSCAL_Y"] == 0.987
    assert calibration["parameters"]["INS_ACCOFFS_Z"] == 0.302
    assert set(imu["timing"]) >= {"gps_delay_s", "gps_smoothing_window_s", "imu_delay_s"}
    assert imu["timing"]["gps_delay_s"] == {"value": 0.081, "sigma": 0.002}
    assert imu["timing"]["gps_smoothing_window_s"] == {"value": None, "sigma": None}
    assert imu["timing"]["imu_delay_s"] == {"value": 0.003, "sigma": None}
    assert imu["rejected"] == {"no_fix": 12, "gps_glitch": 3}
    assert imu["certificate"] == {
        "window_s": 251.0,
        "residual_l2": 0.4,
        "acceleration_bound_m_s2": 1.1,
        "uniform_bound_m_s": 0.9,
        "observed_max_m_s": 0.31,
    }
    assert imu["dead_reckoning"] == {
        "horizon_s": 60.0,
        "drift_before_m_s": 12.1,
        "drift_after_m_s": 0.4,
        "windows": 3,
    }
    assert imu["coverage"]["weakest"] == "z scale"
    assert (imu["coverage"]["percent"], imu["coverage"]["advice"]) == (83.0, "fly banked turns")
    assert "truth" not in imu
    assert "pushed" not in imu


def test_what_is_not_known_is_null():
    (imu,) = written(imu_document(NOTHING_KNOWN))["imus"]
    assert imu["calibration"]["scale"] == [None, None, None]
    assert imu["calibration"]["parameters"] == {}
    assert imu["certificate"] is None
    assert imu["dead_reckoning"] is None


@pytest.mark.parametrize("imu", [1, 2, 3, 4])
def test_parameters_are_named_for_their_accelerometer(imu):
    parameters = imu_document(replace(CALIBRATED, imu=imu)).calibration.parameters
    prefix = {1: "INS_ACC", 2: "INS_ACC2", 3: "INS_ACC3", 4: "INS4_ACC"}[imu]
    assert list(parameters) == [
        f"{prefix}{kind}_{axis}" for kind in ("SCAL", "OFFS") for axis in "XYZ"
    ]


def test_other_autopilots_get_no_parameters_of_ardupilot():
    assert imu_document(CALIBRATED, "px4").calibration.parameters == {}


def test_the_demo_adds_truth_and_what_was_pushed():
    pushed = [PushedDocument(name="INS_ACCSCAL_X", before=1.0, wanted=1.024, read_back=1.024)]
    truth = SixParameters((1.02, 0.99, 1.01), (0.2, -0.1, 0.3))
    (imu,) = written(imu_document(CALIBRATED, truth=truth, pushed=pushed))["imus"]
    assert imu["truth"] == {"scale": [1.02, 0.99, 1.01], "offset": [0.2, -0.1, 0.3]}
    assert imu["pushed"][0]["read_back"] == 1.024
