"""One answer for one flight: right numbers or none, and the same from whoever is asked."""

import numpy as np
import pytest

from onboard.answers.recorded import Recorded
from onboard.answers.replay import replay
from onboard.core.estimate.result import Status
from sitl.builtin import effects
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))


def replayed(tmp_path, *hidden, **about):
    """The answer to a flight, and its recording."""
    spec = FlightSpec(
        **{"vehicle": "plane", "duration": 120.0, "imus": (TRUE,), "effects": hidden, "seed": 3}
        | about
    )
    path = tmp_path / "flight.tlog"
    write_tlog(spec, path)
    return replay([path], Recorded()).answers[0], path


def off(calibration, true=TRUE):
    """Errors of the six in claimed sigmas."""
    error = np.array(calibration.scale + calibration.offset) - np.array(true.scale + true.offset)
    return np.abs(error) / np.array(calibration.scale_sigma + calibration.offset_sigma)


def plain_off(given):
    """The same without what was found."""
    plain = given.diagnosis.plain
    return np.abs(np.array(plain.value) - (*TRUE.scale, *TRUE.offset)) / np.array(plain.sigma)


@pytest.mark.slow
def test_an_untold_antenna_spoils_nothing(tmp_path):
    given, _ = replayed(tmp_path, effects.GpsLeverArm(x=0.9, y=-0.5, z=-0.4))
    assert given.calibration.status is Status.CALIBRATED
    assert off(given.calibration).max() < 4.0


@pytest.mark.slow
def test_axes_that_are_not_square_are_taken_into_account(tmp_path):
    given, _ = replayed(
        tmp_path, effects.CrossAxis(xy=0.05, yx=-0.05, zx=0.05, zy=0.05), duration=150.0
    )
    assert given.calibration.status is Status.CALIBRATED
    assert off(given.calibration).max() < min(4.0, plain_off(given).max())
    assert "cross_axis" in given.calibration.note
    assert given.modelled


@pytest.mark.slow
def test_what_is_no_one_number_is_not_called_calibrated(tmp_path):
    """Nor is what jumps: :mod:`tests.report.test_one_answer`, which also has a complete model."""
    given, _ = replayed(tmp_path, effects.BiasRamp(x=3e-3, y=-2e-3, z=2e-3))
    assert given.calibration.status is Status.INSUFFICIENT
    assert given.missing
