"""Recordings of a simulated ArduPilot with a known truth, and real ones that support nothing."""

import json

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Status
from onboard.recordings.opening import open_recording

pytestmark = pytest.mark.recordings

LIMITS = {
    "plane": ((0.010, 0.010, 0.010), (0.02, 0.02, 0.02)),
    "copter": ((0.004, 0.004, 0.004), (0.01, 0.01, 0.04)),
}
DELAY_LIMIT_S = 0.005


@pytest.fixture(scope="module")
def answers(recordings):
    return json.loads((recordings / "sitl" / "answers.json").read_text())["recordings"]


def calibrated(path):
    made = Calibrator()
    for sample in open_recording(path).samples():
        made.feed(sample)
    made.finish()
    return made


def assert_true(got, truth, vehicle):
    scale, offset = LIMITS[vehicle]
    assert got.status is Status.CALIBRATED, got.note
    for value, true, limit in zip(
        (*got.scale, *got.offset), (*truth["scale"], *truth["offset"]), scale + offset, strict=True
    ):
        assert abs(value - true) < limit, (got.scale, got.offset)
    error = np.array(got.scale + got.offset) - np.array(truth["scale"] + truth["offset"])
    assert error @ np.linalg.solve(np.array(got.covariance), error) < 33.1  # 6 dof: p of 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a07", "b01"])
def test_stream_gives_the_truth(recordings, answers, name):
    truth = answers[name]
    got = calibrated(recordings / "sitl" / f"{name}.tlog").calibration(1)
    assert_true(got, truth, truth["vehicle"])
    assert abs(got.timing["gps_delay_s"].value - truth["net_gps_delay_s"]) < DELAY_LIMIT_S


@pytest.mark.slow
def test_log_gives_the_truth_of_both_accelerometers(recordings, answers):
    truth = answers["c01"]
    made = calibrated(recordings / "sitl" / "c01.BIN")
    assert_true(made.calibration(1), truth, truth["vehicle"])
    assert_true(made.calibration(2), truth["imu2"], truth["vehicle"])


@pytest.mark.slow
def test_what_does_not_move_is_not_calibrated(recordings):
    made = calibrated(recordings / "real" / "real-quad-10-hover.BIN")
    assert made.imus
    for imu in made.imus:
        assert made.calibration(imu).status is not Status.CALIBRATED


def test_what_was_never_armed_has_not_flown(recordings):
    made = calibrated(recordings / "real" / "real-ground-18.BIN")
    assert made.imus == ()
    assert made.flown_s == 0.0
    assert made.standing_s > 60.0
