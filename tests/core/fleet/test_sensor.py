"""The six over flights: values without a prior, and what is merged of them."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.diagnosis.joined import Heard
from onboard.core.diagnosis.together import Asked
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


def heard(*flights, effects=()):
    """Flights, each of which says the same of effects."""
    return [Heard(f, effects) for f in flights]


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


@pytest.mark.parametrize("scale", [0.2, 3.0])
def test_an_offset_is_not_over_a_scale_that_the_flight_does_not_know(scale):
    """Beta is known to 0.3 or 0.1 m/s^2, the scale to nothing, and by chance far off."""
    far = TRUE.copy()
    far[0], far[3] = scale, TRUE[3] * TRUE[0] / scale
    dim = alone(flight(far, [1.0, 0.002, 0.003, 0.3, 0.02, 0.03]), prior())
    seen = alone(flight(far, [1.0, 0.002, 0.003, 0.1, 0.02, 0.03]), prior())
    assert list(np.isfinite(dim.value)) == [False, True, True, False, True, True]
    assert list(np.isfinite(seen.value)) == [False, True, True, True, True, True]
    assert seen.sigma[3] == pytest.approx(np.hypot(0.1, TRUE[3]), rel=0.1)
    assert abs(seen.value[3] - TRUE[3]) < 2.0 * seen.sigma[3]


def test_merged_is_the_weighted_mean_and_never_surer_than_the_floor():
    rng = np.random.default_rng(1)
    flights = [
        flight(parameters_of(linear_of(TRUE) + SIGMA * rng.standard_normal(6))) for _ in range(40)
    ]
    gyro = np.array([0, 0, 0, 0.03, 0.03, 0])
    found = together(heard(*flights), prior(), gyro)
    assert found.counted == tuple(range(40))
    assert not found.contradicted
    assert np.all(np.abs(found.value - TRUE) < 4.0 * found.sigma)
    assert np.all(found.sigma[3:5] > 0.03)  # all flights have the same gyroscope


@pytest.mark.parametrize("count", [5, 30])
def test_a_flight_that_contradicts_is_named_and_not_averaged(count):
    off = TRUE + np.array([0.02, 0, 0, 0.3, 0, 0])
    flights = [flight(TRUE)] * count
    flights[count - 3] = flight(off)
    found = together(heard(*flights), prior(), np.zeros(6))
    assert found.contradicted == (count - 3,)
    assert count - 3 not in found.counted
    assert found.value == pytest.approx(TRUE, abs=1e-3)


def test_of_two_that_contradict_nobody_knows():
    off = TRUE + np.array([0.02, 0, 0, 0.3, 0, 0])
    assert together(heard(flight(TRUE), flight(off)), prior(), np.zeros(6)) is None


def asked(size, sigma, moves):
    """An effect of one unknown with a prior of one: what a flight knows of it and it moves."""
    information = np.array([[sigma**-2.0]])
    moved = np.zeros((6, 1))
    moved[3, 0] = moves
    return Asked("cross_axis", "It leaks", information, information[0] * size, np.ones(1), moved)


def test_what_no_flight_shows_and_all_ask_for_is_in_the_sigma_and_named():
    """Eight flights, each two sigma from none of an effect that moves the x offset."""
    one = asked(0.2, 0.1, 0.5)
    found = together(heard(*[flight(TRUE)] * 8, effects=[one]), prior(), np.zeros(6))
    without = together(heard(*[flight(TRUE)] * 8), prior(), np.zeros(6))
    assert found.value == pytest.approx(without.value)
    assert found.sigma**2 == pytest.approx(without.sigma**2 + found.open_sigma**2)
    assert found.open_sigma[3] == pytest.approx(0.1, rel=0.1)  # 0.5 of an effect of 0.2
    assert found.open_sigma[4] == pytest.approx(0.0, abs=1e-9)
    assert "(cross_axis)" in found.open
    single = together(heard(flight(TRUE), effects=[one]), prior(), np.zeros(6))
    assert single.open == ""


def test_many_flights_are_merged_and_the_last_of_them_after_a_change():
    """Of more flights than sets are looked for, those before count as far back as they agree."""
    off = TRUE + np.array([0.02, 0, 0, 0.3, 0, 0])
    found = together(heard(*[flight(off)] * 4, *[flight(TRUE)] * 36), prior(), np.zeros(6))
    assert found.counted == tuple(range(4, 40))
    assert found.contradicted == (3,)
    assert found.value == pytest.approx(TRUE, abs=1e-3)
