"""On a flight that is as the model says, claimed sigmas are those of the Cramer-Rao bound."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bound import bound
from benchmarks.matched import LEVELS, draw, path
from benchmarks.recorded import error_of, fed


@functools.cache
def aloft(vehicle, duration):
    """A trajectory, and the bound on it; flights draw their noise upon it and leave it as it is."""
    flown = path(vehicle, duration=duration)
    return flown, bound(flown)


@pytest.fixture(
    scope="module",
    params=[
        ("copter", 90.0),
        pytest.param(("plane", 160.0), marks=pytest.mark.slow),
    ],
    ids=lambda flight: "{}-{:.0f}s".format(*flight),
)
def planned(request):
    return request.param


@pytest.fixture(scope="module")
def flown(planned):
    return aloft(*planned)[0]


@pytest.fixture(scope="module")
def whole(planned):
    return aloft(*planned)[1]


@pytest.mark.slow
def test_claims_are_what_physics_allows(flown, whole):
    claimed = []
    for seed in range(3, 6):
        flight = draw(flown, seed)
        scale = flight.truth[1][:3]
        limit = whole * np.concatenate([scale, 1.0 / scale])
        c = fed(flight.samples).calibration(1)
        # The bound takes the gyroscope's axes for those of the accelerometer, and here they are.
        claimed.append(c.sigma_with_its_gyroscope / limit)
        assert np.all(np.abs(error_of(c, flight)) < 4.0 * limit)
    # Levels are found from one flight only (that of the force by a factor of two), and its blocks
    # may contradict each other by chance.
    assert np.all(np.min(claimed, axis=0) > 0.7), claimed
    assert np.all(np.median(claimed, axis=0) > 0.8), claimed
    assert np.all(np.median(claimed, axis=0) < 1.5), claimed


@pytest.mark.slow
def test_claims_know_on_which_axis_the_force_is_shaken():
    """One level for all made z, which lift shakes, attenuated, and x and y the other way round."""
    shaken = replace(LEVELS, lift_walk=0.3)
    flown, calm = aloft("plane", 160.0)
    limit = bound(flown, shaken)
    assert np.all(limit[[0, 1, 3, 4]] < 1.5 * calm[[0, 1, 3, 4]])
    off, claimed = [], []
    for seed in range(3, 7):
        flight = draw(flown, seed, shaken)
        c = fed(flight.samples).calibration(1)
        off.append(error_of(c, flight) / c.sigma_with_its_gyroscope)
        claimed.append(c.sigma_with_its_gyroscope[:2] / (limit[:2] * flight.truth[1][:2]))
    assert np.all(np.median(claimed, axis=0) < 1.5), claimed
    # Of all flights the mean of each number, in sigmas of it.
    assert np.all(np.abs(np.sum(off, axis=0)) / np.sqrt(len(off)) < 4.0), off


@pytest.mark.slow
def test_more_noise_or_less_flight_never_sharpens_the_bound(planned, flown, whole):
    vehicle, duration = planned
    assert np.all(bound(flown, LEVELS.scaled("velocity", 2.0)) > whole)
    for axes in ("force_walk", "lift_walk"):
        assert np.all(bound(flown, LEVELS.scaled(axes, 2.0)) > whole)
    assert np.all(bound(path(vehicle, duration=0.625 * duration)) > whole)
