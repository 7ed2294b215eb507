"""What vehicles share: against the formulas' own limits, and what is said where nothing is."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.fleet.shared import pooled, shared


def test_alike_vehicles_are_a_weighted_mean():
    value, sigma = np.array([1.0, 1.2, 0.9, 1.05]), np.array([0.2, 0.3, 0.25, 0.5])
    found, w = shared(value, sigma), sigma**-2.0
    assert found.between == 0.0
    assert found.mean == pytest.approx(w @ value / w.sum())
    assert found.sigma == pytest.approx(w.sum() ** -0.5)


def test_of_equal_sigmas_the_scatter_is_that_of_the_values():
    """DerSimonian and Laird's estimator is then the variance of the values less theirs."""
    value, sigma = np.array([3.0, -1.0, 7.0, 2.0, -4.0]), np.full(5, 0.5)
    found = shared(value, sigma)
    assert found.between**2 == pytest.approx(np.var(value, ddof=1) - 0.25)
    assert found.mean == pytest.approx(value.mean())
    assert found.sigma == pytest.approx(np.std(value, ddof=1) / np.sqrt(5))
    assert found.scatter_p_value < 1e-6


def test_two_vehicles_are_no_type():
    assert shared(np.ones(2), np.ones(2)) is None


@pytest.mark.parametrize("k", [3, 6, 12])
@pytest.mark.parametrize("between", [0.0, 1.0, 4.0])
def test_nothing_is_shared_by_chance(k, between):
    rng = np.random.default_rng(k)
    alarms = 0
    for _ in range(1000):
        sigma = rng.uniform(0.3, 2.0, k)
        value = rng.normal(0.0, between, k) + sigma * rng.standard_normal(k)
        alarms += shared(value, sigma).p_value <= 0.01
    assert alarms <= 26  # up to 1.9 % are due (docs/fleet.md)


def test_what_is_shared_is_found_with_its_scatter():
    rng = np.random.default_rng(2)
    found, inside, between = 0, 0, []
    for _ in range(300):
        sigma = rng.uniform(0.01, 0.03, 12)
        value = 0.15 + rng.normal(0.0, 0.03, 12) + sigma * rng.standard_normal(12)
        its = shared(value, sigma)
        found += its.p_value < 1e-3
        inside += abs(its.mean - 0.15) < 2.2 * its.sigma  # 95 % of eleven degrees
        between.append(its.between)
    assert found == 300
    assert inside >= 0.91 * 300
    assert np.median(between) == pytest.approx(0.03, rel=0.15)


def test_flights_that_scatter_make_a_vehicle_less_sure():
    sigma = np.full(12, 0.1)
    calm = pooled(np.full(12, 2.0), sigma)
    wild = pooled(2.0 + np.tile([-1.0, 1.0], 6), sigma)
    assert calm[0] == pytest.approx(wild[0])
    assert wild[1] > 5.0 * calm[1] == pytest.approx(5.0 * 0.1 / np.sqrt(12))
