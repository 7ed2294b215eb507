"""A plane in gusts: what they do to its laws, and how much of that is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_match import match_plane
from onboard.core.vehicle.turned import Turned
from tests.core.vehicle.flights import plane_flight, smooth

SIGMA = np.array([0.003, 0.003, 0.01])


def matched(**change):
    flight = plane_flight(reading=1.0, seconds=240.0, **change)
    match = match_plane(flight, PlaneAirframe(), SIGMA)
    assert match is not None
    return match


def told(match):
    return {d.name for d in match.effects} - {"turbulence"}


def turned(E, b, prior, lean=0.0):
    size = np.atleast_1d(np.asarray(b, dtype=float))
    m = len(size)
    return Turned(
        np.atleast_2d(E),
        size,
        np.full(m, prior),
        np.full((m, 1), lean) if lean else np.zeros((m, 0)),
    )


@pytest.mark.parametrize("answered", [0.0, 0.3, 1.0])
def test_a_slope_by_angles_that_are_off_is_short_by_no_more_than_is_said(answered):
    """Force and angle that gusts have moved by ``1 - answered`` and ``answered`` of themselves."""
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(200):
        angle, gust = rng.normal(size=400), 0.4 * rng.normal(size=400)
        force = 2.0 * (angle - (1.0 - answered) * gust) + 0.01 * rng.normal(size=400)
        seen = angle + answered * gust
        N, E = float(seen @ seen), float(gust @ gust)
        found = float(seen @ force) / N
        doubt = turned(E, found * E, 1e-6).covariance(np.array([[N]]), [0])
        plain = np.var(force - found * seen) / N
        errors.append((found - 2.0) / np.sqrt(doubt[0, 0] + plain))
    assert np.mean(np.abs(errors) < 2.0) > 0.9
    if answered == 1.0:
        # It is all short, by more than half of what twice the doubt allows.
        assert np.median(errors) < -1.0


def test_gusts_that_may_be_all_there_is_leave_what_was_known_before():
    doubt = turned(99.0, 50.0, 1.0 / 0.3**2).covariance(np.array([[100.0]]), [0])
    assert np.sqrt(doubt[0, 0]) == pytest.approx(0.3)


def test_what_was_taken_for_known_is_a_doubt_of_its_share():
    doubt = turned(0.0, 0.0, 1.0, lean=20.0).covariance(np.array([[100.0]]), [0])
    assert np.sqrt(doubt[0, 0]) == pytest.approx(0.2)


def test_an_unknown_that_gusts_do_not_touch_is_in_no_doubt():
    covariance = turned(np.diag([30.0, 0.0]), [10.0, 0.0], 1.0).covariance(
        100.0 * np.eye(2), [0, 1]
    )
    assert covariance[1, 1] == pytest.approx(0.0)
    assert covariance[0, 0] > 0.0


@pytest.mark.slow
def test_gusts_alone_accuse_no_coefficient():
    match = matched(seed=41, gusts=0.5)
    assert told(match) == set()
    assert match.explained
    assert match.wind is not None
    assert match.wind.turbulence_rms > 0.3


@pytest.mark.slow
def test_drag_is_found_in_gusts():
    match = matched(seed=44, gusts=0.5, c_drag_p=0.055)
    assert told(match) == {"drag"}
    number = match.numbers["drag.c_drag_p"]
    assert abs(number.real - 0.055) < 3.0 * number.sigma
    assert number.sigma < 0.02


@pytest.mark.slow
def test_thrust_is_found_in_gusts():
    match = matched(seed=45, gusts=0.5, ratio=0.75)
    assert told(match) == {"thrust_scale"}
    number = match.numbers["thrust_scale.ratio"]
    assert abs(number.real - 0.75) < 3.0 * number.sigma


@pytest.mark.slow
def test_lift_is_found_in_gusts_by_its_mean():
    match = matched(seed=46, gusts=0.5, c_lift_0=0.36)
    assert told(match) == {"lift"}
    constant, slope = (match.numbers[f"lift.{key}"] for key in ("c_lift_0", "c_lift_a"))
    assert abs(constant.real - 0.36) < 3.0 * constant.sigma
    assert abs(slope.real - 6.9) < 3.0 * slope.sigma
    # How much of it is the slope's the gusts hide, and the mean lift is known all the same.
    assert slope.sigma > 1.0
    mean = constant.real - 0.03 * slope.real
    assert mean == pytest.approx(0.36 - 0.03 * 6.9, abs=0.06)


@pytest.mark.slow
def test_side_force_is_found_in_gusts_by_the_rudder_that_holds_the_sideslip():
    match = matched(seed=47, gusts=0.3, c_y_b=-0.4, rudder_by_slip=3.0)
    assert told(match) == {"side_force"}
    number = match.numbers["side_force.c_y_b"]
    assert abs(number.real + 0.4) < 3.0 * number.sigma


@pytest.mark.slow
def test_a_rudder_that_follows_the_sideslip_is_not_taken_for_side_force():
    """It knows the sideslip without the gusts: least squares would give it all of the force."""
    match = matched(seed=47, gusts=0.5, rudder_by_slip=3.0)
    assert told(match) == set()
    for key, truth in (("c_y_b", -0.98), ("c_y_deltar", -0.2)):
        number = match.numbers[f"side_force.{key}"]
        assert abs(number.real - truth) < number.sigma


@pytest.mark.slow
def test_what_gusts_hide_is_not_called_tested():
    """With a rudder that knows nothing of the sideslip, nothing tells its force."""
    match = matched(seed=47, gusts=0.5, c_y_b=-0.45)
    assert told(match) == set()
    assert match.numbers["side_force.c_y_b"].sigma > 0.4
    assert "gusts" in next(n.why for n in match.not_testable if n.name == "side_force")


@pytest.mark.slow
def test_a_lift_between_nothing_and_what_can_be_named_is_not_called_explained():
    match = matched(seed=50, gusts=0.5, c_lift_0=0.68)
    assert told(match) == set()
    assert not match.explained
    assert "lift would explain" in match.note
    assert "gusts" in next(n.why for n in match.not_testable if n.name == "lift")


@pytest.mark.slow
def test_gusts_explain_no_more_than_gusts_of_their_size_do():
    """A force to the side that wanders, thrice what gusts of 0.8 m/s make of it."""
    flight = plane_flight(reading=1.0, seconds=240.0, gusts=0.8, seed=3)
    force = 8.0 * smooth(np.random.default_rng(1), len(flight), 1.0)
    f_b = flight.f_b + force[:, None] * (0.0, 1.0, 0.0)
    match = match_plane(replace(flight, f_b=f_b), PlaneAirframe(), SIGMA)
    assert match is not None
    assert {d.name for d in match.effects} == {"turbulence"}
    assert not match.explained


@pytest.mark.slow
@pytest.mark.parametrize(("sigma", "named"), [(0.01, True), (0.4, False)])
def test_what_an_airspeed_sensor_reads_beyond_a_velocity_that_is_off_is_no_gust(sigma, named):
    """An error of the velocity looks like air to the sensor; how large it may be is known."""
    flight = plane_flight(seed=17, seconds=240.0, reading=1.0)
    rng = np.random.default_rng(3)
    wrong = np.stack([smooth(rng, len(flight), 0.35, 5.0) for _ in range(3)], axis=1)
    flight.v_n[:] += wrong
    flight.v_b[:] = np.einsum("nij,nj->ni", flight.R_bn, flight.v_n)
    match = match_plane(replace(flight, velocity_sigma=sigma), PlaneAirframe(), SIGMA)
    assert match is not None
    assert ("turbulence" in {d.name for d in match.effects}) is named
