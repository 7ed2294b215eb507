"""Parameters and the estimator's linear unknowns are two names for one sensor."""

import numpy as np
import pytest

from onboard.core.maths.accelerometer import (
    SixParameters,
    linear_of,
    parameters_jacobian,
    parameters_of,
)

SENSOR = SixParameters((1.02, 0.97, 1.01), (0.3, -0.2, 0.5))


def test_there_and_back():
    parameters = SENSOR.as_vector()
    np.testing.assert_allclose(parameters_of(linear_of(parameters)), parameters, rtol=1e-15)


def test_both_give_the_same_force():
    raw = np.array([[1.0, -2.0, -9.8], [0.0, 3.0, -15.0]])
    linear = SENSOR.as_linear()
    np.testing.assert_allclose(SENSOR.apply(raw), raw * linear[:3] + linear[3:], rtol=1e-14)
    np.testing.assert_allclose(SENSOR.undo(SENSOR.apply(raw)), raw, rtol=1e-14)


def test_the_jacobian_is_the_slope():
    at, step = SENSOR.as_linear(), 1e-6
    for j, column in enumerate(parameters_jacobian(at).T):
        d = step * np.eye(6)[j]
        slope = (parameters_of(at + d) - parameters_of(at - d)) / (2.0 * step)
        np.testing.assert_allclose(column, slope, atol=1e-8)


@pytest.mark.parametrize("more", [0, 7])
def test_a_whole_solution_may_be_given(more):
    theta = np.concatenate([SENSOR.as_linear(), np.ones(more)])
    np.testing.assert_allclose(parameters_of(theta), SENSOR.as_vector(), rtol=1e-15)
