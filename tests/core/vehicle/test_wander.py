"""A wind that wanders for longer than a gust lasts has a noise of its own."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.slow_wind import SlowWind, Wander, doubt_of
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.signals import Signals
from onboard.core.vehicle.wander import wander_of
from tests.core.vehicle.flights import STEP, copter_flight

SIGMA = np.full(3, 0.01)
FRAME = CopterAirframe.of({})
WIND = (4.0, -3.0)


def wandering(seed, rms, time_s):
    """A flight of three minutes in air that wanders; the force of it by the slope of its drag."""
    flight = copter_flight(seed=seed, seconds=180.0, wind=WIND)
    rng = np.random.default_rng([seed, 3])
    keeps, n = np.exp(-STEP / time_s), len(flight)
    air = np.zeros((n, 3))
    air[0, :2] = rms * rng.normal(size=2)
    for k in range(1, n):
        air[k, :2] = keeps * air[k - 1, :2] + np.sqrt(1 - keeps**2) * rms * rng.normal(size=2)
    still = flight.v_b - np.einsum("nij,j->ni", flight.R_bn, [*WIND, 0.0])
    slope = 0.25 + 0.0581 * 1.17 * np.abs(still)
    along = np.einsum("nij,nj->ni", flight.R_bn, air)
    flight.f_b[:, :2] += slope[:, :2] * along[:, :2]
    return flight


@pytest.mark.parametrize("time_s", [18.0, 40.0])
def test_a_wind_beside_slow_gusts_is_as_far_off_as_its_sigmas_say(time_s):
    apart, named = [], 0
    for seed in range(4):
        match = match_copter(wandering(seed, 0.7, time_s), Signals(), FRAME, SIGMA)
        wind = match.wind
        named += "wind" in {d.name for d in match.effects}
        apart += [(wind.north - WIND[0]) / wind.sigma_north]
        apart += [(wind.east - WIND[1]) / wind.sigma_east]
    # Of eight normal numbers, one in a thousand times more than this.
    assert np.sum(np.square(apart)) < 26.1
    # It is a wind of the flight for all that.
    assert named == 4


def test_slow_gusts_are_told_as_such():
    for seed in (5, 6):
        wander = wander_of(fitted(copter_model(wandering(seed, 0.7, 20.0), FRAME, SIGMA)))
        assert wander is not None
        assert 10.0 < wander.time_s < 60.0


def test_calm_air_does_not_wander():
    flight = copter_flight(seed=7, wind=WIND)
    assert wander_of(fitted(copter_model(flight, FRAME, SIGMA))) is None


def test_a_mean_over_a_long_flight_is_off_by_what_independent_winds_average_to():
    flight = copter_flight(seed=8, seconds=360.0, still=True)
    wander = Wander(0.5, 6.0)
    assert doubt_of(flight, wander) == pytest.approx(0.5 * np.sqrt(2 * 6.0 / 360.0), rel=0.25)
    assert doubt_of(flight, None) == 0.0


def test_modes_are_winds_without_a_mean_over_the_flight():
    flight = copter_flight(seed=9, seconds=120.0, still=True)
    slow = SlowWind(flight, Wander(0.5, 30.0))
    for k in range(len(slow.unknowns)):
        values = np.eye(len(slow.unknowns))[k]
        np.testing.assert_allclose(slow.wind(flight, values.tolist()).mean(axis=0), 0.0, atol=1e-9)
    # North and east have the process's variance but for its mean, and for what the noise tells.
    told = sum(u.plausible**2 for u in slow.unknowns) / 2.0 / 11.0
    assert 0.8 * (0.25 - doubt_of(flight, slow.wander) ** 2) < told < 0.3
