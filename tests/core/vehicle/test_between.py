"""What flights of one vehicle differ by, and what of their differences is only uncertainty."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.between import spread
from onboard.core.vehicle.copter import Variant, copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.records import VehicleMatch
from onboard.core.vehicle.several import joined
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import assert_derivatives, copter_flight, smooth
from tests.core.vehicle.test_several import SIGMA, measured

PRIOR = 0.15


def posterior(
    true: np.ndarray, covariance: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """What a fit with the prior says of numbers that data tell with this covariance."""
    told = true + np.linalg.cholesky(covariance) @ rng.standard_normal(len(true))
    known = np.linalg.inv(covariance)
    both = np.linalg.inv(known + np.eye(len(true)) / PRIOR**2)
    return both @ known @ told, both


@pytest.mark.parametrize("really", [0.02, 0.05, 0.1])
def test_the_spread_is_what_is_left_beyond_uncertainties_that_go_together(really: float) -> None:
    rng, found = np.random.default_rng(7), []
    for _ in range(60):
        root = 0.01 * (np.eye(20) + 0.3 * rng.standard_normal((20, 20)))
        true = really * rng.standard_normal(20)
        found.append(spread(*posterior(true, root @ root.T, rng), PRIOR))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(really, rel=0.12)


def test_flights_that_are_alike_differ_by_nothing_in_half_of_the_cases() -> None:
    """And by little in the others: the likeliest spread is zero or half a sigma."""
    rng = np.random.default_rng(8)
    covariance = np.diag(np.linspace(0.01, 0.03, 14) ** 2)
    found = [spread(*posterior(np.zeros(14), covariance, rng), PRIOR) for _ in range(200)]
    assert 0.4 < np.mean(np.equal(found, 0.0)) < 0.75
    assert max(found) < 0.03


def test_what_no_flight_tells_does_not_count() -> None:
    rng = np.random.default_rng(9)
    covariance = np.diag([0.01**2] * 10 + [1e3**2] * 10)
    true = np.concatenate([0.05 * rng.standard_normal(10), np.zeros(10)])
    estimate, both = posterior(true, covariance, rng)
    assert spread(estimate, both, PRIOR) == pytest.approx(
        spread(estimate[:10], both[:10, :10], PRIOR)
    )


def flights(apart: float, count: int = 7) -> list[tuple[np.ndarray, object]]:
    """Winds and flights, each with a slope over its own motion beside its drag."""
    rng, out = np.random.default_rng(11), []
    for k in range(count):
        wind = 3.0 * rng.standard_normal(2)
        flight = copter_flight(seed=200 + k, seconds=60.0, wind=wind, c_m=0.45, noise=0.05)
        own = apart * rng.standard_normal(2)
        flight.f_b[:, :2] -= own * (flight.v_b[:, :2] - flight.v_b[:, :2].mean(axis=0))
        out.append((wind, flight))
    return out


def test_derivatives_and_means_of_the_force_of_a_flights_own_motion() -> None:
    every = [f for _, f in flights(0.0, 3)]
    sigmas = np.tile(SIGMA, (3, 1))
    model = copter_model(joined(every), CopterAirframe(), sigmas, Variant(moving=PRIOR))
    assert_derivatives(model)
    theta = model.nominal
    still = model.predicted(theta)
    theta[[k for k, u in enumerate(model.unknowns) if u.name.startswith("moving_")]] = 0.1
    apart = model.predicted(theta) - still
    assert np.abs(apart).max() > 0.1
    for part in range(3):
        mean = apart[model.flight.part == part].mean(axis=0)
        np.testing.assert_allclose(mean, 0.0, atol=1e-12)


def through(apart: float, count: int = 7) -> list[tuple[np.ndarray, object]]:
    """Winds and flights in gusty air, in each of which the thrust shows another wind besides."""
    rng, out = np.random.default_rng(11), []
    for k in range(count):
        wind = 3.0 * rng.standard_normal(2)
        flight = copter_flight(seed=1300 + k, seconds=60.0, wind=wind, c_m=0.45, noise=0.05)
        flight.f_b[:, 2] += 0.45 * (flight.R_bn[:, 2, :2] @ (apart * rng.standard_normal(2)))
        for axis in (0, 1):
            flight.f_b[:, axis] += smooth(rng, len(flight), 0.4, 1.0)
        out.append((wind, flight))
    return out


def matched_beside_the_others(every: list[tuple[np.ndarray, object]]) -> VehicleMatch:
    """With the winds of all flights measured but of the first."""
    told = [f if k == 0 else measured(f, w[0], w[1], 0.1) for k, (w, f) in enumerate(every)]
    sigmas = np.tile(SIGMA, (len(every), 1))
    return match_copter(joined(told), Signals(kind="copter"), CopterAirframe(), sigmas)


def test_a_wind_that_only_the_thrust_shows_acts_along_it_and_on_nothing_else() -> None:
    every = [f for _, f in flights(0.0, 3)]
    model = copter_model(
        joined(every), CopterAirframe(), np.tile(SIGMA, (3, 1)), Variant(through=2.0)
    )
    assert_derivatives(model)
    theta = model.nominal
    theta[model.indices("wind")[0]] = -5.0
    still = model.predicted(theta)
    theta[[k for k, u in enumerate(model.unknowns) if u.name.startswith("through_")]] = 1.0
    apart = model.predicted(theta) - still
    assert np.all(apart[:, :2] == 0.0)
    assert np.abs(apart[:, 2]).max() > 0.05


@pytest.mark.slow
def test_a_wind_is_honest_whatever_the_thrust_says_of_it() -> None:
    """Told by a thrust that contradicts the drag it was 2.3 sigma off, and 3.7 on other flights."""
    every = through(2.0, 5)
    wind, (north, east) = matched_beside_the_others(every).wind, every[0][0]
    assert wind is not None
    assert wind.sigma_north < 0.2
    assert wind.north == pytest.approx(north, abs=2.0 * wind.sigma_north)
    assert wind.east == pytest.approx(east, abs=2.0 * wind.sigma_east)


@pytest.mark.slow
def test_the_wind_of_a_flight_whose_own_motion_is_no_law_is_found_by_those_of_the_others() -> None:
    """Six winds are known: means tell the drag, and slopes that are each flight's own do not."""
    every = flights(0.1)
    match = matched_beside_the_others(every)
    wind, (north, east) = match.wind, every[0][0]
    assert wind is not None
    assert wind.sigma_north < 0.06  # 0.11 where slopes are taken for the law's
    assert wind.sigma_east < 0.06
    assert wind.north == pytest.approx(north, abs=3.0 * wind.sigma_north)
    assert wind.east == pytest.approx(east, abs=3.0 * wind.sigma_east)
    drag = match.numbers["rotor_drag.mcoef"]
    assert drag.real == pytest.approx(0.45, abs=3.0 * drag.sigma)
