"""What replay says of flights whose model lacks something: right numbers, or none."""

import numpy as np
import pytest

from onboard.caution import with_caution
from onboard.core.calibrator import Calibrator
from onboard.core.result import Status
from onboard.replay import replay
from sitl.builtin import effects
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))


def replayed(tmp_path, *hidden):
    spec = FlightSpec(vehicle="plane", duration=200.0, imus=(TRUE,), effects=hidden, seed=3)
    path = tmp_path / "flight.tlog"
    write_tlog(spec, path)
    calibrator = Calibrator()
    plain = replay([path], calibrator)
    return plain.calibrations[0], with_caution(plain, calibrator).calibrations[0]


def off(calibration):
    """Errors of the six in claimed sigmas."""
    error = np.array(calibration.scale + calibration.offset) - np.array(TRUE.scale + TRUE.offset)
    return np.abs(error) / np.array(calibration.scale_sigma + calibration.offset_sigma)


def test_a_complete_model_is_left_alone(tmp_path):
    plain, cautious = replayed(tmp_path)
    assert plain.status is Status.CALIBRATED
    assert cautious is plain


def test_an_untold_antenna_spoils_nothing(tmp_path):
    plain, cautious = replayed(tmp_path, effects.GpsLeverArm(x=0.9, y=-0.5, z=-0.4))
    assert off(plain).max() < 4.0
    assert cautious.status is Status.CALIBRATED
    assert off(cautious).max() < 4.0


def test_axes_that_are_not_square_are_taken_into_account(tmp_path):
    plain, cautious = replayed(tmp_path, effects.CrossAxis(xy=0.05, yx=-0.05, zx=0.05, zy=0.05))
    assert cautious.status is Status.CALIBRATED
    assert off(cautious).max() < min(4.0, off(plain).max())
    assert "cross_axis" in cautious.note


@pytest.mark.parametrize(
    "hidden",
    [effects.BiasStep(time=110.0, x=0.4, y=-0.3, z=0.3), effects.BiasRamp(x=3e-3, y=-2e-3, z=2e-3)],
    ids=["step", "ramp"],
)
def test_what_is_no_one_number_is_not_given(tmp_path, hidden):
    _, cautious = replayed(tmp_path, hidden)
    assert cautious.status is Status.INSUFFICIENT
