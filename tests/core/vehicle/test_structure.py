"""What repeats with the motion, or changes over minutes, is not air that moves at random."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.beyond import LAWS
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import STEP, copter_flight

SIGMA = np.full(3, 0.01)


def matched(flight):
    return match_copter(flight, Signals(), CopterAirframe.of({}), SIGMA)


def names(match):
    return {d.name for d in match.effects}


def pushed(flight, x, y):
    flight.f_b[:, 0] += x
    flight.f_b[:, 1] += y
    return flight


def gusty(flight, rms, correlation_s, seed, slope=0.25):
    """Air that moves at random along north and east, by what it does to a drag of this slope."""
    rng = np.random.default_rng(seed)
    n = len(flight)
    phi = np.exp(-STEP / correlation_s)
    gust = np.zeros((n, 3))
    for k in range(1, n):
        gust[k, :2] = phi * gust[k - 1, :2] + np.sqrt(1 - phi**2) * rms * rng.normal(size=2)
    along = np.einsum("nij,nj->ni", flight.R_bn, gust)
    return pushed(flight, slope * along[:, 0], slope * along[:, 1])


FORCES = {
    "across": lambda u: (-0.08 * u[:, 1], 0.08 * u[:, 0]),
    "unequal": lambda u: (0.08 * u[:, 0], -0.08 * u[:, 1]),
    "climbing": lambda u: (0.04 * u[:, 0] * u[:, 2], 0.04 * u[:, 1] * u[:, 2]),
    "steeper": lambda u: tuple(-0.002 * np.sum(u**2, axis=1) * u[:, k] for k in (0, 1)),
}


@pytest.mark.parametrize(("key", "seed"), [(key, k) for k, key in enumerate(FORCES)])
def test_a_force_that_repeats_with_the_speed_is_no_gust(key, seed):
    flight = copter_flight(seed=seed, seconds=150.0)
    match = matched(pushed(flight, *FORCES[key](flight.v_b)))
    assert "turbulence" not in names(match)
    assert LAWS[key].said in match.note
    assert not match.explained
    # What is not handed back explains nothing.
    assert not {"rotor_drag", "body_drag"} & names(match) or not LAWS[key].spoils


def test_the_other_numbers_are_right_beside_it():
    flight = copter_flight(seed=5, wind=(3.0, -2.0), c_m=0.4)
    still = flight.v_b - np.einsum("nij,j->ni", flight.R_bn, [3.0, -2.0, 0.0])
    numbers = matched(pushed(flight, *FORCES["across"](still))).numbers
    for key, truth in (("wind.north", 3.0), ("wind.east", -2.0), ("rotor_drag.mcoef", 0.4)):
        assert abs(numbers[key].real - truth) < 4.0 * numbers[key].sigma


def test_drag_that_differs_between_the_axes_has_no_one_number():
    flight = copter_flight(seed=6, c_m=0.3)
    match = matched(pushed(flight, 0.1 * flight.v_b[:, 0], -0.1 * flight.v_b[:, 1]))
    assert not {"rotor_drag", "body_drag"} & names(match)
    assert "another ahead than aside" in match.note
    assert "have no numbers" in match.note


@pytest.mark.parametrize(("seed", "correlation_s"), [(0, 1.5), (2, 10.0)])
def test_gusts_repeat_with_nothing(seed, correlation_s):
    flight = copter_flight(seed=40 + seed, wind=(2.0, 1.0))
    match = matched(gusty(flight, 0.6, correlation_s, seed))
    assert "no effect describes it" not in match.note
    assert correlation_s > 4.0 or "became another" not in match.note


def test_a_wind_that_turns_over_minutes_is_no_gust_and_its_mean_is_told():
    match = matched(copter_flight(seed=1, wind=(2.0, 0.0), turning=(0.0, 2.0)))
    assert names(match) == {"wind"}
    assert match.explained
    assert "the wind became another" in match.note
    assert match.wind.north == pytest.approx(2.0, abs=0.15)
    assert match.wind.east == pytest.approx(0.0, abs=0.15)
    assert match.wind.change == pytest.approx(2.0 / np.sqrt(3.0), rel=0.15)
    ends = match.wind.law[[0, -1], 1]
    assert ends == pytest.approx([-1.9, 1.9], abs=0.3)


def test_nothing_is_said_of_a_wind_that_stays():
    match = matched(copter_flight(seed=9, wind=(3.0, 1.0)))
    assert match.wind.change == 0.0
    assert "became another" not in match.note


def test_a_flight_that_shows_nothing_has_no_gusts_either():
    """In pieces that are too short to tell anything from, what is left is no evidence of air."""
    flight = gusty(copter_flight(seed=3, seconds=80.0, wind=(2.0, 1.0)), 2.0, 2.0, 3)
    assert matched(flight).shown
    flight.piece[:] = np.arange(len(flight))
    match = matched(flight)
    assert not match.shown
    assert names(match) == set()
    assert "no effect at any plausible size" in match.note
