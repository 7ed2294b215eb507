"""What repeats along a copter's rotors, and no effect knows, is neither another thrust nor air."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.effects.beyond_rotors import ROTORS
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import STEP, copter_flight, smooth

pytestmark = pytest.mark.slow
SIGMA = np.full(3, 0.01)
WIND = (3.0, -2.0)


def matched(flight):
    return match_copter(flight, Signals(), CopterAirframe.of({}), SIGMA)


def names(match):
    return {d.name for d in match.effects}


def still(flight):
    """Velocity through the air, body axes."""
    return flight.v_b - np.einsum("nij,j->ni", flight.R_bn, [*WIND, 0.0])


def lifted(flight, force):
    flight.f_b[:, 2] -= force
    return flight


def gains(flight):
    """Rotors pull 15 % more at speed, written as a bell: none at rest, all of it past 8 m/s."""
    speed = np.linalg.norm(still(flight)[:, :2], axis=1)
    return -flight.f_b[:, 2] * 0.15 * (1.0 - np.exp(-((speed / 5.0) ** 2)))


def warms(flight):
    """Motors lose a tenth of their thrust within the first minute or so."""
    return 0.1 * flight.f_b[:, 2] * (1.0 - np.exp(-STEP * np.arange(len(flight)) / 50.0))


def turns(flight):
    flight.w_b[:, 2] = smooth(np.random.default_rng(5), len(flight), 0.5)
    return 0.4 * flight.w_b[:, 2]


LAWS = {
    "forward": gains,
    "lifting": lambda flight: 0.02 * np.sum(still(flight)[:, :2] ** 2, axis=1),
    "ahead": lambda flight: 0.08 * still(flight)[:, 0],
    "warming": warms,
    "yawing": turns,
    "higher": lambda flight: 0.015 * (flight.height - 620.0),
}


@pytest.mark.parametrize("key", LAWS)
def test_a_force_along_the_rotors_that_repeats_has_no_other_name(key):
    # What goes with the speed may be taken for drag in a shorter flight.
    long = 240.0 if key in ("forward", "lifting") else 150.0
    flight = copter_flight(seed=7, wind=WIND, seconds=long)
    match = matched(lifted(flight, LAWS[key](flight)))
    assert ROTORS[key].said in match.note
    assert not match.explained
    # A tenth less in the mean is less thrust; the others have none.
    assert names(match) <= {"wind"} | ({"thrust_scale"} if key == "warming" else set())
    assert match.wind.north == pytest.approx(WIND[0], abs=0.15)
    assert match.wind.east == pytest.approx(WIND[1], abs=0.15)


@pytest.mark.parametrize("seed", [7, 8])
def test_drag_of_rotors_is_known_no_better_than_what_of_their_pull_is_theirs(seed):
    """A force beside them that is taken for theirs made their drag 6 % less, by 7 sigma."""
    flight = copter_flight(seed=seed, wind=WIND, seconds=150.0)
    match = matched(lifted(flight, gains(flight)))
    assert names(match) <= {"wind"}
    assert not match.explained
    drag = match.numbers["rotor_drag.mcoef"]
    # That none of it is theirs is the end of what may be: past the root mean square by 1.7.
    assert abs(drag.real - drag.simulation) < 3.0 * drag.sigma


def test_what_effects_explain_along_the_rotors_has_no_law_beside_it():
    """Also a voltage that is measured with noise, which time would tell better."""
    flight = copter_flight(seed=63, wind=WIND, volts=(12.6, 10.8), sag=1.0, lag=0.1)
    flight.battery[:, 0] += np.random.default_rng(63).normal(0.0, 0.02, len(flight))
    match = matched(flight)
    assert names(match) == {"wind", "voltage_sag", "motor_lag"}
    assert "repeats" not in match.note
    assert match.explained


def test_gusts_along_the_rotors_repeat_with_nothing():
    flight = copter_flight(seed=71, wind=WIND)
    match = matched(lifted(flight, smooth(np.random.default_rng(971), len(flight), 0.3, 1.5)))
    assert "repeats" not in match.note
    assert names(match) == {"wind"}


def test_a_sag_that_physics_has_not_is_something_else():
    """Motors that get warm while the battery empties: thrust falls with more than the square."""
    flight = copter_flight(seed=8, wind=WIND, volts=(12.6, 11.6), sag=1.0)
    tired = np.linspace(0.0, 0.12, len(flight))
    match = matched(lifted(flight, tired * flight.f_b[:, 2]))
    assert "voltage_sag" not in names(match)
    assert "more than physics has" in match.note
    assert not match.explained
