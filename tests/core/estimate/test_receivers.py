"""Receivers that spread what they report in time, in whatever shape."""

import numpy as np
import pytest

from sitl.builtin.gps import SPREADING
from sitl.builtin.smoothing import DT
from sitl.builtin.truth import GpsTruth
from tests.core.estimate.test_simulated_flights import TRUE, assert_true, calibrated, flown


@pytest.mark.parametrize("window", [0.1, 0.35, 0.6])
@pytest.mark.parametrize("response", SPREADING)
def test_the_simulated_ones_spread_alike_and_are_as_late(response, window):
    """Their answer to a pulse has the mean and the variance of an even one."""
    t = DT * np.arange(-3000, 3001)
    pulse = np.where(np.abs(t) < 0.5 * DT, 1.0, 0.0)[:, None]
    answer = SPREADING[response](pulse, window)[:, 0]
    assert answer.sum() == pytest.approx(1.0)
    mean = answer @ t
    assert mean == pytest.approx(0.0, abs=DT)
    assert answer @ (t - mean) ** 2 == pytest.approx(window**2 / 12.0, rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "response"), [("copter" if r == "filter" else "plane", r) for r in SPREADING]
)
def test_its_shape_does_the_calibration_no_harm(vehicle, response):
    """By a shape taken for another, z scale and offset of a quiet plane were ten sigma off."""
    quiet = GpsTruth(
        smoothing=0.5, response=response, velocity_noise=0.004, velocity_coloured=0.002, jitter=0.0
    )
    samples, delay = flown(vehicle, 150.0, gps=quiet, seed=3)
    got = calibrated(samples)
    assert_true(got)
    error = np.array(got.scale + got.offset) - np.array(TRUE.scale + TRUE.offset)
    assert np.all(np.abs(error) <= 3.0 * np.array(got.scale_sigma + got.offset_sigma))
    late, window = got.timing["gps_delay_s"], got.timing["gps_smoothing_window_s"]
    assert late.value == pytest.approx(delay, abs=3.0 * late.sigma)
    assert window.value == pytest.approx(0.5, abs=3.0 * window.sigma)
