"""A flight of a minute or less: its sigmas are as large as its errors, and it says what it cannot.

What the recorded motion is off by shows in no scatter of so few phases of flight, but its sizes are
known (:mod:`onboard.core.vehicle.motion_errors`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.maths.frames import rotation_from_vector
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.block_sums import BlockSums
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.flight import DRIFT
from onboard.core.vehicle.inflation import inflated, inflation_of, unfitted
from onboard.core.vehicle.motion_errors import errors_of
from onboard.core.vehicle.plane import plane_model
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from tests.core.vehicle.flights import G, copter_flight, plane_flight, smooth
from tests.core.vehicle.planes import matched, names

FORCE_SIGMA = np.full(3, 0.005)


def off_by(flight, velocity):
    """The flight as it is recorded by a receiver that is off by so much (n, 3), m/s."""
    v_n = flight.v_n + velocity
    return replace(flight, v_n=v_n, v_b=np.einsum("nij,nj->ni", flight.R_bn, v_n))


def turned(flight, about):
    """The same with an attitude that is turned about north, east and down by (n, 3), rad."""
    R_bn = flight.R_bn @ np.swapaxes(rotation_from_vector(about), -1, -2)
    return replace(flight, R_bn=R_bn, v_b=np.einsum("nij,nj->ni", R_bn, flight.v_n))


def test_scatter_of_few_blocks_is_that_of_flight_that_was_not_fitted():
    """Of rows of unit variance it is one in the mean, however much of a number one block tells."""
    m, prior = 4, np.full(4, 1e-6)
    none = np.zeros(m, dtype=bool)
    got, plain = [], []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        rows = [rng.normal(size=(12, m)) for _ in range(6)]
        rows[2][:, 3] *= 5.0  # the one turn
        every, y = np.concatenate(rows), rng.normal(size=72)
        theta = np.linalg.solve(every.T @ every + np.diag(prior), every.T @ y)
        left = np.split(y - every @ theta, 6)
        blocks = [
            BlockSums(H.T @ H, H.T @ r, float(r @ r), len(r), np.arange(m))
            for H, r in zip(rows, left, strict=True)
        ]
        inverse = np.linalg.inv(every.T @ every + np.diag(prior))
        scores = np.stack([block.b for block in blocks])
        made = unfitted(blocks, scores, inverse)
        got.append(np.sum((made @ inverse) ** 2, axis=0) / np.diag(inverse))
        plain.append(np.sum((scores @ inverse) ** 2, axis=0) / np.diag(inverse))
        inflation, _ = inflation_of(blocks, prior, none, np.zeros((m, 1)))
        assert np.all(inflation >= 1.0)
    np.testing.assert_allclose(np.mean(got, axis=0), 1.0, atol=0.15)
    # As they are, a number by one turn would be told from nothing.
    assert np.mean(plain, axis=0)[3] < 0.5


def test_what_was_known_before_is_as_sure_as_it_was_and_what_two_know_together_is_not():
    """Of two unknowns of which the rows know the sum alone."""
    rows, prior = 1e4 * np.ones((2, 2)), np.array([4.0, 4.0])
    C = inflated(rows + np.diag(prior), prior, np.full(2, 9.0))
    of_sum, of_difference = (float(way @ C @ way) for way in np.array([[1.0, 1.0], [1.0, -1.0]]))
    assert of_sum == pytest.approx(9.0 / 1e4, rel=0.01)
    assert of_difference == pytest.approx(2.0 / 4.0)
    plain = np.linalg.inv(rows + np.diag(prior))
    assert inflated(rows + np.diag(prior), prior, np.ones(2)) == pytest.approx(plain)


def test_no_variance_is_less_than_nothing_where_rows_that_tell_all_of_a_few_contradict():
    """A plane that slips once by 60 degrees: what it tells is 1e15 times what was known before."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        prior = 10.0 ** rng.uniform(-2.0, 4.0, 12)
        rows = 1e5 * np.sqrt(prior) * rng.normal(size=(4, 12))
        inflation = 10.0 ** rng.uniform(0.0, 6.0, 12)
        C = inflated(rows.T @ rows + np.diag(prior), prior, inflation)
        # In units of what was known before: never less than nothing in any direction.
        scaled = C * np.sqrt(np.outer(prior, prior))
        assert np.linalg.eigvalsh(scaled)[0] > -1e-9 * np.max(np.diag(scaled))
        assert np.all(np.diag(C) > 0.0)


def test_an_error_of_known_size_adds_what_it_does_to_the_estimate():
    """A number on which it acts alone is as unsure as the error; none is surer than by scatter."""
    prior, N = np.full(2, 1e-6), np.diag([4.0, 100.0])
    blocks = [BlockSums(N / 4.0, np.zeros(2), 1.0, 10, np.arange(2)) for _ in range(4)]
    error = np.array([[4.0 * 3.0], [0.0]])
    got, _ = inflation_of(blocks, prior, np.zeros(2, dtype=bool), error)
    np.testing.assert_allclose(got / np.diag(N), [1.0 / 4.0 + 9.0, 1.0 / 100.0], rtol=1e-4)


@pytest.mark.parametrize("kind", ["copter", "plane"])
def test_errors_of_the_motion_are_what_such_a_motion_makes(kind):
    if kind == "copter":
        flight = copter_flight(seed=3, seconds=30.0, wind=(2.0, -1.0))
        model_of = lambda f: copter_model(f, CopterAirframe(), FORCE_SIGMA)  # noqa: E731
    else:
        flight = plane_flight(seed=3, seconds=30.0, wind=(2.0, -1.0))
        model_of = lambda f: plane_model(f, PlaneAirframe(), FORCE_SIGMA)  # noqa: E731
    n = len(flight)
    unsure = np.zeros((n, 4))
    unsure[:, 0] = 1e-3 * (flight.f_b[:, 0] - flight.f_b[:, 0].mean())
    flight = replace(flight, velocity_sigma=0.01, unsure=unsure)
    model = model_of(flight)
    theta = model.nominal
    theta[model.indices("wind")] = 2.0, -1.0
    (errors,) = errors_of(model, theta)
    knots = 4
    assert errors.shape == (n, len(model.axes), 3 * knots + 1)
    before = model.measured() - model.predicted(theta)

    def change(wrong):
        its = model_of(wrong)
        return its.measured() - its.predicted(theta) - before

    for axis in range(3):
        # All knots at once are an error that lasts; its variance is one and a half between them.
        lasting = np.zeros((n, 3))
        lasting[:, axis] = 0.01 * np.sqrt(1.5)
        made = errors[:, :, axis : 3 * knots : 3].sum(axis=-1)
        np.testing.assert_allclose(
            made, change(off_by(flight, lasting)), atol=0.02 * np.abs(made).max()
        )
    # A force that is read too large leans the attitude until the velocity is right again.
    f_n = np.einsum("nij,ni->nj", flight.R_bn[:, :1], unsure[:, :1])
    about = np.column_stack([-f_n[:, 1], f_n[:, 0], np.zeros(n)]) / G
    f_b = flight.f_b + np.column_stack([unsure[:, 0], np.zeros((n, 2))])
    wrong = turned(replace(flight, f_b=f_b), about)
    made = errors[:, :, -1]
    np.testing.assert_allclose(made, change(wrong), atol=0.05 * np.abs(made).max())


@pytest.mark.parametrize("kind", ["copter", "plane"])
def test_a_short_flight_knows_its_wind_no_better_than_its_velocity(kind):
    """Errors of the wind over their sigmas, of flights of 40 s whose velocity wanders."""
    squares = []
    for seed in range(8):
        rng = np.random.default_rng(700 + seed)
        if kind == "copter":
            flight = copter_flight(seed=700 + seed, seconds=40.0, wind=(3.0, -2.0))
        else:
            flight = plane_flight(seed=700 + seed, seconds=40.0, wind=(3.0, -2.0))
        size = 0.05
        velocity = np.stack([smooth(rng, len(flight), size) for _ in range(3)], axis=1)
        flight = replace(off_by(flight, velocity), velocity_sigma=size)
        model = (
            copter_model(flight, CopterAirframe(), FORCE_SIGMA)
            if kind == "copter"
            else plane_model(flight, PlaneAirframe(), FORCE_SIGMA)
        )
        fit = fitted(model)
        places = model.indices("wind")
        squares.append((fit.theta[places] - [3.0, -2.0]) ** 2 / fit.sigma[places] ** 2)
    # Of 16 numbers: chi-square is between 5.1 and 34 with a chance of 1 in 200 for either side.
    assert 5.1 / 16.0 < np.mean(squares) < 34.3 / 16.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_heading_that_drifts_is_no_side_force_of_none(seed):
    """On a straight flight the rudder tells all of the slip, and the heading less than that."""
    flight = plane_flight(
        seed=seed, seconds=40.0, turning=0.01, rudder_by_slip=1.5, noise=0.02, reading=1.0
    )
    drift = np.zeros((len(flight), 4))
    drift[:, DRIFT] = 0.01 * np.linspace(-1.7, 1.7, len(flight))
    about = np.zeros((len(flight), 3))
    about[:, 2] = 2.0 * drift[:, DRIFT]
    flight = replace(
        turned(flight, about), unsure=drift, attitude_sigma=np.array([1e-3, 1e-3, 0.03])
    )
    match = matched(flight)
    assert "side_force" not in names(match)
    assert abs(match.wind.north) < 4.0 * match.wind.sigma_north
    assert abs(match.wind.east) < 4.0 * match.wind.sigma_east
