"""Flights merged as Gaussians: exact, honest, and silent where flights contradict each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.joint import FLOOR
from onboard.core.estimate.merged_flights import (
    FlightSix,
    Prior,
    flight_six,
    merged,
    reconciled,
)
from onboard.core.maths.accelerometer import SixParameters, linear_of, parameters_jacobian
from onboard.core.maths.arrays import vector3
from tests.cli.results import CALIBRATED

SIGMA = np.repeat([0.03, 0.5], 3)
PRIOR = Prior(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), SIGMA)
GOOD = np.array([0.002, 0.002, 0.003, 0.01, 0.01, 0.03])


def flight(rng, truth, sigmas=GOOD, mixed=True, off=0.0):
    """A flight's rows of a linear model with unit noise, and what it says of the six."""
    V = np.linalg.qr(rng.standard_normal((6, 6)))[0] if mixed else np.eye(6)
    rows = V / sigmas
    y = rows @ (truth + off) + rng.standard_normal(6)
    N, b = rows.T @ rows, rows.T @ y
    return FlightSix(N, b, N, b)


def drawn(rng):
    return PRIOR.center + SIGMA * rng.standard_normal(6)


def test_it_is_the_solution_of_all_rows_together():
    rng = np.random.default_rng(1)
    truth = drawn(rng)
    flights = [flight(rng, truth, GOOD * k) for k in (1.0, 2.0, 0.7)]
    got = merged(flights, PRIOR)
    N = sum(f.information for f in flights) / got.inflation
    b = sum(f.vector for f in flights) / got.inflation
    A = N + np.diag(SIGMA**-2.0)
    np.testing.assert_allclose(
        got.estimate, np.linalg.solve(A, b + PRIOR.center / SIGMA**2), rtol=1e-9
    )
    np.testing.assert_allclose(got.covariance, np.linalg.inv(A), rtol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 8])
def test_an_error_that_is_alike_in_all_flights_does_not_become_less_with_their_number(count):
    """Against the joint solution: six, and an offset of each axis that all flights have."""
    rng = np.random.default_rng(3)
    truth, sigma = drawn(rng), np.array([0.0, 0.0, 0.0, 0.03, 0.05, 0.0])
    alone = [flight(rng, truth, GOOD, mixed=False, off=sigma) for _ in range(count)]
    said = []
    for f in alone:
        P = np.linalg.inv(f.information) + np.diag(sigma**2)
        N, b = np.linalg.inv(P), np.linalg.solve(P, np.linalg.solve(f.information, f.vector))
        said.append(FlightSix(N, b, N, b, sigma**2))
    got = merged(said, PRIOR)
    # Rows of every flight are of the six and of the error, which has a prior of its own.
    both = np.hstack([np.eye(6), np.eye(6)])
    N = sum(both.T @ f.information @ both for f in alone) / got.inflation
    b = sum(both.T @ f.vector for f in alone) / got.inflation
    prior = np.concatenate([SIGMA**-2.0, np.where(sigma > 0.0, sigma, 1e-9) ** -2.0])
    A = N + np.diag(prior)
    x = np.linalg.solve(A, b + prior * np.concatenate([PRIOR.center, np.zeros(6)]))
    np.testing.assert_allclose(got.covariance, np.linalg.inv(A)[:6, :6], rtol=1e-4, atol=1e-10)
    np.testing.assert_allclose(got.estimate, x[:6], atol=1e-6)
    shrunk = 1.0 / (sigma[3:5] ** -2.0 + SIGMA[3:5] ** -2.0)  # the prior tells as little as ever
    assert np.all(np.diag(got.covariance)[3:5] > shrunk)


def test_a_flight_without_that_error_tells_it():
    rng = np.random.default_rng(4)
    truth, sigma = drawn(rng), np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.05])
    fine = flight(rng, truth, GOOD, mixed=False)
    coarse = replace(flight(rng, truth, GOOD + sigma, mixed=False, off=sigma), alike=sigma**2)
    got = merged([coarse, fine], PRIOR)
    assert np.all(np.sqrt(np.diag(got.covariance)) < GOOD * np.sqrt(got.inflation))


def test_one_poor_flight_without_that_error_does_not_make_it_another_one_in_each_of_the_others():
    rng = np.random.default_rng(5)
    truth, sigma = drawn(rng), np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.05])
    said = []
    for _ in range(8):
        alone = flight(rng, truth, GOOD, mixed=False, off=sigma)
        P = np.linalg.inv(alone.information) + np.diag(sigma**2)
        N, b = (
            np.linalg.inv(P),
            np.linalg.solve(P, np.linalg.solve(alone.information, alone.vector)),
        )
        said.append(FlightSix(N, b, N, b, sigma**2))
    got = merged([*said, flight(rng, truth, 30.0 * GOOD, mixed=False)], PRIOR)
    assert np.all(np.sqrt(np.diag(got.covariance))[3:] > 0.9 * sigma[3:])
    assert np.all(np.abs(got.estimate - truth)[3:] < 3.0 * np.sqrt(np.diag(got.covariance))[3:])


def test_intervals_hold_the_truth_and_what_no_flight_shows_keeps_the_prior():
    rng = np.random.default_rng(2)
    hover = np.where(np.arange(6) % 3 == 2, 1e4, 1.0) * GOOD
    errors = []
    for _ in range(400):
        truth = drawn(rng)
        flights = [flight(rng, truth, hover, mixed=False) for _ in range(3)]
        got = merged(flights, PRIOR)
        sigma = np.sqrt(np.diag(got.covariance))
        errors.append((got.estimate - truth) / sigma)
        np.testing.assert_allclose(sigma[[2, 5]], SIGMA[[2, 5]], rtol=1e-3)
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all((spread > 0.85) & (spread < 1.1))


@pytest.mark.parametrize("kind", ["full", "hover", "unlike"])
def test_flights_of_one_sensor_contradict_each_other_once_in_a_thousand(kind):
    rng = np.random.default_rng(3)
    hover = np.where(np.arange(6) % 3 == 2, 30.0, 1.0) * GOOD
    plane = np.where(np.arange(6) % 3 == 1, 12.0, 1.5) * GOOD
    kinds = {"full": (GOOD, GOOD), "hover": (hover, hover), "unlike": (hover, plane)}[kind]
    chi, dof, wrong, n = 0.0, 0, 0, 4000
    for _ in range(n):
        truth = drawn(rng)
        found = reconciled([flight(rng, truth, s, mixed=kind != "hover") for s in kinds], PRIOR)
        chi, dof = chi + found.scatter.chi_square, dof + found.scatter.dof
        wrong += not found.counted
    assert chi / dof == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / dof) + 0.01)
    assert wrong <= 12  # expected: 4
    assert dof > 2 * n


def test_of_two_that_contradict_nobody_knows_which_is_right():
    rng = np.random.default_rng(4)
    truth = drawn(rng)
    found = reconciled([flight(rng, truth), flight(rng, truth, off=10.0 * GOOD)], PRIOR)
    assert found.counted == ()
    assert found.contradicted == (0, 1)
    assert all(a.contradicted for a in found.apart)
    assert not found.earlier


OTHER = 12.0 * GOOD


@pytest.mark.parametrize(
    ("which", "counted"),
    [
        ("aaa", (0, 1, 2)),
        ("aba", (0, 2)),  # one erred
        ("baa", (1, 2)),  # it erred, or the sensor changed: the later ones count both times
        ("aab", ()),  # changed, or erred: the next flight tells
        ("aabb", (2, 3)),
        ("abab", ()),
        ("aabaa", (0, 1, 3, 4)),
        ("abcaa", (0, 3, 4)),
        ("a", (0,)),
    ],
)
def test_who_counts(which, counted):
    rng = np.random.default_rng(5)
    truth = drawn(rng)
    off = {"a": 0.0, "b": OTHER, "c": -OTHER}
    found = reconciled([flight(rng, truth, off=off[x]) for x in which], PRIOR)
    assert found.counted == counted
    if counted:
        assert set(found.contradicted) == set(range(len(which))) - set(counted)
        assert all(found.apart[i].contradicted for i in found.contradicted)
        assert not any(found.apart[i].contradicted for i in counted)
    else:
        assert found.contradicted == ((2,) if which == "aab" else (0, 1, 2, 3))


def test_a_last_flight_that_says_little_does_not_decide():
    rng = np.random.default_rng(6)
    truth = drawn(rng)
    flights = [flight(rng, truth), flight(rng, truth, off=OTHER), flight(rng, truth, SIGMA * 2.0)]
    assert reconciled(flights, PRIOR).counted == ()


def test_flights_that_know_nothing_in_common_do_not_contradict():
    rng = np.random.default_rng(7)
    truth = drawn(rng)
    first = flight(rng, truth, np.where(np.arange(6) < 3, GOOD, 1e3), mixed=False)
    second = flight(rng, truth, np.where(np.arange(6) < 3, 1e3, GOOD), mixed=False)
    found = reconciled([first, second], PRIOR)
    assert (found.scatter.dof, found.counted) == (0, (0, 1))
    sigma = np.sqrt(np.diag(merged([first, second], PRIOR).covariance))
    np.testing.assert_allclose(sigma, GOOD, rtol=0.01)


def calibration(rng, truth, in_force, sigmas=GOOD):
    """A calibration as a flight gives it, from data of scale and beta."""
    f = flight(rng, linear_of(truth), sigmas)
    before = linear_of(np.array(in_force))
    C = np.linalg.inv(f.information + np.diag(SIGMA**-2.0))
    x = C @ (f.vector + before / SIGMA**2)
    J = parameters_jacobian(x)
    P = J @ C @ J.T + np.diag(FLOOR**2)
    six = np.concatenate([x[:3], -x[3:] / x[:3]])
    made = replace(
        CALIBRATED,
        scale=vector3(six[:3]),
        offset=vector3(six[3:]),
        covariance=tuple(map(tuple, (P + P.T) / 2)),
        in_force_scale=tuple(in_force[:3]),
        in_force_offset=tuple(in_force[3:]),
    )
    return f, made


def test_a_calibration_gives_back_what_its_flight_said_whatever_was_in_force():
    rng = np.random.default_rng(8)
    truth = np.array([1.02, 0.985, 1.015, 0.25, -0.2, 0.3])
    for in_force in ((1.0,) * 3 + (0.0,) * 3, (1.03, 0.97, 1.02, 0.4, -0.3, 0.2)):
        f, made = calibration(rng, truth, in_force)
        got = flight_six(made)
        np.testing.assert_allclose(got.information, f.information, rtol=1e-6, atol=1e-3)
        np.testing.assert_allclose(
            np.linalg.solve(got.information, got.vector),
            np.linalg.solve(f.information, f.vector),
            atol=1e-8,
        )
        assert np.all(np.diag(got.floored) < np.diag(got.information))


def test_samples_that_were_not_raw_are_of_the_raw_sensor_all_the_same():
    rng = np.random.default_rng(9)
    applied = SixParameters((1.01, 0.98, 1.02), (0.1, -0.2, 0.3))
    raw = rng.standard_normal((50, 3)) * 3.0
    six = linear_of(np.array([1.02, 0.99, 1.01, 0.2, 0.1, -0.1]))
    corrected = applied.apply(raw)
    force = six[:3] * corrected + six[3:]
    N = np.eye(6)
    got = FlightSix(N, N @ six, N, N @ six).of_raw(applied)
    x = np.linalg.solve(got.information, got.vector)
    np.testing.assert_allclose(x[:3] * raw + x[3:], force, rtol=1e-9)
