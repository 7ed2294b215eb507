"""Gyroscopes whose scale is wrong, and an autopilot that believes them."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.parameters import ParametersInForce
from tests.core.estimate.test_simulated_flights import TRUE, assert_true, calibrated, flown

WRONG = (0.03, -0.02, 0.025)


@pytest.mark.slow
def test_one_that_is_wrong_costs_little():
    """Held for right in quick turns, the attitude made y scale 3 sigma off, sigmas 2 to 5 times."""
    wider = []
    for seed in range(3, 6):
        right, wrong = (
            calibrated(flown("copter", 150.0, imu=replace(TRUE, gyro_scale=scale), seed=seed)[0])
            for scale in ((0.0, 0.0, 0.0), WRONG)
        )
        assert_true(wrong)
        error = np.array(wrong.scale + wrong.offset) - np.array(TRUE.scale + TRUE.offset)
        sigma = np.array(wrong.scale_sigma + wrong.offset_sigma)
        assert np.all(np.abs(error) <= 3.0 * sigma)
        wider.append(sigma / np.array(right.scale_sigma + right.offset_sigma))
    assert np.all(np.median(wider, axis=0) <= 1.15)


@pytest.mark.parametrize(
    ("values", "imu"),
    [
        ({}, 1),
        ({"EK3_PRIMARY": 1.0}, 2),
        ({"EK3_PRIMARY": 1.0, "EK3_IMU_MASK": 5.0}, 3),
        ({"EK3_PRIMARY": 0.0, "EK3_IMU_MASK": 6.0}, 2),
        ({"EK3_PRIMARY": 3.0, "EK3_IMU_MASK": 3.0}, 1),
        ({"EK3_IMU_MASK": 0.0}, 1),
    ],
)
def test_whose_gyroscope_an_ekf_integrates(values, imu):
    """The lane that is preferred, counted among those that the mask makes."""
    assert ParametersInForce(dict(values)).attitude_imu == imu
