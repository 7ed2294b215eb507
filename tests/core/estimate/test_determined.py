"""What a flight determines, and what it is worth: against the parabola, and against draws."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.determined import determine, force_moments
from tests.push.calibrations import OFFSET, SCALE, calibration, covariance

GRAVITY = 9.80665
IN_FORCE = (1.0, 1.0, 1.0, 0.02, -0.03, 0.04)
PRIOR = np.array([0.03] * 3 + [0.5] * 3)


def with_covariance(P, values=(*SCALE, *OFFSET), **more):
    return calibration(
        scale=tuple(values[:3]),
        offset=tuple(values[3:]),
        covariance=tuple(map(tuple, P)),
        **more,
    )


def at_one_load(load=-GRAVITY, sigma=0.02):
    """Covariance of a flight that knows every axis, but z at one load only."""
    H = np.diag(1.0 / np.array([0.002, 0.002, 0.03, 0.01, 0.01, 0.5]) ** 2)
    row = np.zeros(6)
    row[2], row[5] = load, -1.0
    return np.linalg.inv(H + np.outer(row, row) / sigma**2)


def test_what_is_known_altogether_is_the_estimate():
    found = determine(calibration(), IN_FORCE)
    assert found.six.scale + found.six.offset == (*SCALE, *OFFSET)
    assert found.known == found.free == (True,) * 6
    assert found.directions == 6
    assert found.contradiction == 0.0
    assert found.sigma == pytest.approx(np.sqrt(np.diag(covariance())))


def test_held_numbers_are_the_minimum_of_the_parabola_on_their_plane():
    """Independent route: minimise (v - x)^T N (v - x) over the free ones, N = P^-1."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(6, 40))
    unit = np.array([1e-3, 0.025, 1e-3, 1e-2, 0.45, 1e-2])
    R = A @ A.T
    d = np.sqrt(np.diag(R))
    P = R / np.outer(d, d) * np.outer(unit, unit)
    x = np.array((*SCALE, *OFFSET))
    held = np.array([False, True, False, False, True, False])
    k = x + np.where(held, 0.3 * unit, 2.0 * unit)
    # Both numbers of an axis are held: no combination of theirs is known better.
    prior = np.where(held, 1.3 * unit, PRIOR)
    found = determine(with_covariance(P, x, prior_sigma=tuple(prior)), k)
    f = np.array(found.free)
    np.testing.assert_array_equal(f, ~held)
    N = np.linalg.inv(P)
    free = x[f] - np.linalg.solve(N[np.ix_(f, f)], N[np.ix_(f, ~f)] @ (k - x)[~f])
    values = np.array(found.six.scale + found.six.offset)
    assert values[~f] == pytest.approx(k[~f], abs=0)
    assert found.directions == 4
    assert values[f] == pytest.approx(free, rel=1e-9)
    C = P[np.ix_(~f, ~f)]
    assert found.contradiction == pytest.approx((k - x)[~f] @ np.linalg.solve(C, (k - x)[~f]))


def test_a_hover_knows_the_z_axis_at_its_load_and_nothing_else_of_it():
    P = at_one_load()
    found = determine(with_covariance(P), IN_FORCE)
    assert found.known == (True, True, False, True, True, False)
    assert found.free == (True,) * 6
    assert found.directions == 5
    s, o = found.six.scale[2], found.six.offset[2]
    raw = -GRAVITY
    told = SCALE[2] * (raw - OFFSET[2])
    # The combination is set, to the second order of the 0.7 % of scale.
    assert s * (raw - o) == pytest.approx(told, abs=2e-3)
    assert found.error_after < 0.3 * found.error_before


def test_a_direction_that_is_not_known_stays_as_in_force():
    """The z axis is moved the shortest way, in units of the prior, and along no other."""
    P = at_one_load(sigma=0.001)
    found = determine(with_covariance(P), IN_FORCE)
    values = np.array(found.six.scale + found.six.offset)
    x, y = ((values - IN_FORCE) / PRIOR)[[2, 5]]
    # Force at the load: -g ds - do, so the shortest way is along (-g ds_prior, -do_prior).
    known = np.array([-GRAVITY * PRIOR[2], -PRIOR[5]])
    across = (x * known[1] - y * known[0]) / np.linalg.norm(known)
    assert abs(across) < 0.02 * np.hypot(x, y)


def test_nothing_is_determined_by_the_prior_alone():
    P = np.diag((0.95 * PRIOR) ** 2)
    found = determine(with_covariance(P), IN_FORCE)
    assert found.directions == 0
    assert found.six.scale + found.six.offset == IN_FORCE
    assert found.change == 0.0
    assert found.probability == 0.5


def test_a_number_that_the_flight_contradicts_is_not_held_however_wide_it_is():
    sigmas = np.array([0.002, 0.002, 0.002, 0.01, 0.01, 0.3])
    far = (*SCALE, *OFFSET[:2], IN_FORCE[5] + 1.2)
    found = determine(with_covariance(np.diag(sigmas**2), far), IN_FORCE)
    assert not found.known[5]
    assert found.free[5]
    assert found.six.offset[2] == pytest.approx(far[5])
    assert found.contradiction <= found.contradiction_limit


@pytest.mark.parametrize("wide", [0.02, 0.1, 0.4])
def test_probability_and_errors_are_those_of_draws(wide):
    """Truths drawn from the estimate: how often, and by how much, the force becomes better."""
    rng = np.random.default_rng(7)
    sigmas = np.array([0.01, 0.012, 0.01, 0.05, 0.1, wide])
    R = np.eye(6)
    R[2, 5] = R[5, 2] = 0.8
    P = R * np.outer(sigmas, sigmas)
    mean, square = (0.3, -0.2, -9.7), (2.0, 1.5, 96.0)
    x = np.array([1.0, 1.01, 0.99, 0.06, -0.1, 0.1])
    given = with_covariance(P, x, load_mean=mean, load_square=square)
    found = determine(given, IN_FORCE)
    truth = rng.multivariate_normal(x, P, size=40_000)
    M = force_moments(mean, square, IN_FORCE)

    def loss(six):
        off = truth - np.array(six)
        return np.einsum("ni,ij,nj->n", off, M, off)

    before, after = loss(IN_FORCE), loss(found.six.scale + found.six.offset)
    assert found.probability == pytest.approx(np.mean(after < before), abs=0.01)
    assert found.error_before**2 == pytest.approx(np.mean(before), rel=0.03)
    assert found.error_after**2 == pytest.approx(np.mean(after), rel=0.03)


def test_moments_are_those_of_samples():
    rng = np.random.default_rng(1)
    raw = rng.normal([0.1, -0.4, -9.6], [1.0, 2.0, 0.7], size=(500, 3))
    six = np.array([1.02, 0.98, 1.01, 0.1, -0.2, 0.3])
    by = np.array([1e-3, -2e-3, 5e-4, 0.01, 0.02, -0.03])
    M = force_moments(raw.mean(axis=0), (raw**2).mean(axis=0), six)
    # The error of the force is linear in the six to first order: its derivative.
    error = by[:3] * (raw - six[3:]) - six[:3] * by[3:]
    assert by @ M @ by == pytest.approx(np.mean(np.sum(error**2, axis=1)), rel=1e-9)


@pytest.mark.parametrize(
    "bad",
    [
        {"scale": (float("nan"), 1.0, 1.0)},
        {"covariance": covariance(correlations=[(0, 3, 1.1)])},
        {"covariance": ((float("nan"),) * 6,) * 6},
    ],
)
def test_what_is_no_estimate_determines_nothing(bad):
    with pytest.raises(ValueError, match=r"covariance|estimate"):
        determine(replace(calibration(), **bad), IN_FORCE)
