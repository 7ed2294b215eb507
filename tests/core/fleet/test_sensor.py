"""The six over flights: values without a prior, and what is merged of them."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.merged_flights import FlightSix, Prior
from onboard.core.fleet.sensor import alone, together
from onboard.core.maths.accelerometer import linear_of, parameters_of

SIGMA = np.array([0.002, 0.002, 0.003, 0.02, 0.02, 0.03])
PRIOR = np.array([0.03, 0.03, 0.03, 0.5, 0.5, 0.5])
TRUE = np.array([1.012, 0.991, 1.004, 0.12, -0.2, 0.3])


def flight(six, sigma=SIGMA):
    """What a flight says that knows scale and beta with these sigmas, independently."""
    N = np.diag(1.0 / np.asarray(sigma) ** 2)
    return FlightSix(N, N @ linear_of(np.asarray(six)), N, N @ linear_of(np.asarray(six)))


def prior(center=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)):
    return Prior(linear_of(np.array(center)), PRIOR)


def test_a_value_does_not_lean_on_what_was_in_force():
    one = alone(flight(TRUE), prior())
    other = alone(flight(TRUE), prior((1.05, 0.95, 1.0, 0.6, 0.6, -0.6)))
    assert one.value == pytest.approx(TRUE, abs=1e-5)
    assert other.value == pytest.approx(one.value, abs=1e-5)
    assert one.sigma[:3] == pytest.approx(SIGMA[:3], rel=1e-3)


def test_a_number_that_the_flight_does_not_know_has_no_value():
    seen = alone(flight(TRUE, [0.002, 0.002, 0.5, 0.02, 0.02, 9.0]), prior())
    assert list(np.isfinite(seen.value)) == [True, True, False, True, True, False]


def test_merged_is_the_weighted_mean_and_never_surer_than_the_floor():
    rng = np.random.default_rng(1)
    flights = [
        flight(parameters_of(linear_of(TRUE) + SIGMA * rng.standard_normal(6))) for _ in range(40)
    ]
    gyro = np.array([0, 0, 0, 0.03, 0.03, 0])
    found = together(flights, range(40), prior(), gyro)
    assert found.counted == tuple(range(40))
    assert not found.contradicted
    assert np.all(np.abs(found.value - TRUE) < 4.0 * found.sigma)
    assert np.all(found.sigma[3:5] > 0.03)  # all flights have the same gyroscope


@pytest.mark.parametrize("count", [5, 30])
def test_a_flight_that_contradicts_is_named_and_not_averaged(count):
    off = TRUE + np.array([0.02, 0, 0, 0.3, 0, 0])
    flights = [flight(TRUE)] * count
    flights[count - 3] = flight(off)
    found = together(flights, range(count), prior(), np.zeros(6))
    assert found.contradicted == (count - 3,)
    assert count - 3 not in found.counted
    assert found.value == pytest.approx(TRUE, abs=1e-3)


def test_of_two_that_contradict_nobody_knows():
    off = TRUE + np.array([0.02, 0, 0, 0.3, 0, 0])
    assert together([flight(TRUE), flight(off)], (0, 1), prior(), np.zeros(6)) is None
