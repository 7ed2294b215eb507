"""How much blocks contradict each other: against draws of known variance, and dense rows."""

import math

import numpy as np
import pytest

from onboard.core.diagnosis.score import least, surprise
from onboard.core.estimate.limits import BLOCKS_TOGETHER
from onboard.core.estimate.pool import Pool
from onboard.core.estimate.scatter import Scatter
from onboard.core.estimate.weighing import Weighing, directions_of
from onboard.core.maths.student import log_survival_f, two_sided
from tests.core.estimate.test_solution import MODEL, M, blocks_of, flight

PRIOR = 1.0 / MODEL.prior_sigma**2
DRAWS = 300


def ratios(rng, count, centre=1.0, freedom=math.inf):
    """Variances of some directions over what is claimed, as ``count`` (k,) blocks show them."""
    true = np.full(len(count), centre)
    if math.isfinite(freedom):
        true = centre * freedom / rng.chisquare(freedom, len(count))
    return true * rng.chisquare(count) / count


def test_directions_that_differ_by_chance_are_one():
    rng = np.random.default_rng(4)
    count = rng.uniform(4.0, 25.0, 15)
    pools = [Pool.of(ratios(rng, count), count, 1.0) for _ in range(DRAWS)]
    assert np.median([p.variance for p in pools]) < 1.15
    assert np.mean([p.freedom < 8.0 for p in pools]) < 0.03
    quiet = [Pool.of(ratios(rng, count, 0.2), count, 1.0) for _ in range(DRAWS)]
    assert all(p.variance == 1.0 for p in quiet)


@pytest.mark.parametrize("centre", [1.5, 4.0])
@pytest.mark.parametrize("freedom", [3.0, 10.0])
def test_centre_and_width_are_found(centre, freedom):
    rng = np.random.default_rng(7)
    count = rng.uniform(4.0, 25.0, 20)
    pools = [Pool.of(ratios(rng, count, centre, freedom), count, 1.0) for _ in range(DRAWS)]
    assert np.median([p.variance for p in pools]) == pytest.approx(centre, rel=0.25)
    found = np.median([p.freedom for p in pools])
    assert 0.5 * freedom < found < 2.5 * freedom


def test_moderated_variances_are_nearer_to_the_true_ones_than_their_own_or_one_for_all():
    rng = np.random.default_rng(9)
    count = rng.uniform(3.0, 15.0, 18)
    errors = []
    for _ in range(DRAWS):
        true = 1.5 * 4.0 / rng.chisquare(4.0, len(count))
        own = true * rng.chisquare(count) / count
        pool = Pool.of(own, count, 1.0)
        shrunk = [pool.moderated(float(r), float(n))[0] for r, n in zip(own, count, strict=True)]
        errors.append([np.mean(np.log(x / true) ** 2) for x in (shrunk, own, own.mean())])
    mine, alone, common = np.mean(errors, axis=0)
    assert mine < 0.8 * alone
    assert mine < 0.8 * common


@pytest.mark.parametrize(("n", "count"), [(240, 8), (2 * 3 * BLOCKS_TOGETHER, 3 * BLOCKS_TOGETHER)])
def test_scores_of_blocks_are_held_against_the_hat_matrix(n, count):
    """What is expected of a block follows from the covariance of all residuals, written out."""
    h, y = flight(3, n, noise=1.0)
    inverse = np.linalg.inv(h.T @ h + np.diag(PRIOR))
    theta = inverse @ (h.T @ y + PRIOR * MODEL.prior)
    left = np.eye(n) - h @ inverse @ h.T
    scatter = Scatter.of(blocks_of(h, y, count), theta, inverse, np.zeros(M))
    for j in range(M):
        found, expected = 0.0, []
        for rows in np.split(np.arange(n), count):
            score = inverse[j] @ h[rows].T
            found += float(score @ (y - h @ theta)[rows]) ** 2
            expected.append(float(score @ left[np.ix_(rows, rows)] @ score))
        ratio, blocks = scatter.within(inverse[:, [j]])
        assert ratio == pytest.approx(found / sum(expected), rel=1e-9)
        effective = sum(expected) ** 2 / sum(e**2 for e in expected)
        assert blocks == pytest.approx(effective, rel=1e-9)


@pytest.fixture
def problem():
    """Information, its directions and strengths, and a noise that is not what it claims."""
    rng = np.random.default_rng(2)
    D = np.diag(rng.uniform(0.1, 30.0, M)) + 0.3
    X, strength = directions_of(D, PRIOR)
    root = rng.normal(size=(M, M))
    return D, X, strength, np.eye(M) + root @ root.T


def test_directions_are_independent_in_the_data_and_in_the_prior(problem):
    D, X, strength, _ = problem
    np.testing.assert_allclose(X.T @ D @ X, np.diag(strength), atol=1e-9 * strength.max())
    np.testing.assert_allclose(X.T @ np.diag(PRIOR) @ X, np.eye(M), atol=1e-10)


def test_an_estimates_covariance_is_that_of_its_errors(problem):
    """Of the prior's and of the scores', each through the estimate as the linear map that it is."""
    D, X, strength, V = problem
    weighing = Weighing(X, strength, V)
    K = np.stack([weighing.estimate(e) for e in np.eye(M)], axis=1)
    half = np.linalg.inv(X).T @ np.diag(np.sqrt(strength))
    of_scores = K @ (half @ V @ half.T) @ K.T
    of_prior = (K @ D - np.eye(M)) @ np.diag(1.0 / PRIOR) @ (K @ D - np.eye(M)).T
    got = weighing.covariance(weighing.noise(D))
    np.testing.assert_allclose(got, of_scores + of_prior, rtol=1e-7, atol=1e-12)


def test_with_one_variance_for_all_it_is_the_posterior(problem):
    D, X, strength, _ = problem
    weighing = Weighing(X, strength, 3.0 * np.eye(M))
    A = D / 3.0 + np.diag(PRIOR)
    score = np.arange(1.0, M + 1.0)
    np.testing.assert_allclose(weighing.estimate(score), np.linalg.solve(A, score / 3.0), rtol=1e-8)
    got = weighing.covariance(weighing.noise(D))
    np.testing.assert_allclose(got, np.linalg.inv(A), rtol=1e-8)


def test_the_tail_of_f_is_that_of_known_cases():
    for freedom in (2.0, 5.5, 40.0):
        for f in (0.3, 2.0, 30.0):
            t = two_sided(math.sqrt(f), freedom)
            assert math.exp(log_survival_f(f, 1, freedom)) == pytest.approx(t, rel=1e-9)
            closed = (1.0 + 2.0 * f / freedom) ** (-0.5 * freedom)
            assert math.exp(log_survival_f(f, 2, freedom)) == pytest.approx(closed, rel=1e-9)
    # Far out, where no number is small enough.
    assert log_survival_f(1e9, 3, 400.0) < -1000.0


@pytest.mark.parametrize("freedom", [4.0, 12.0, 100.0])
@pytest.mark.parametrize("places", [1.0, 30.0])
def test_over_an_estimated_variance_as_much_is_found_by_chance_as_over_a_known_one(freedom, places):
    """At the decision the score is that of Fisher's F; beyond it, it grows with the gain."""
    for variance in (1.0, 5.0):
        gains = np.geomspace(10.0, 1e7, 8000)
        scores = [surprise(g, 3, places, 5.0 * variance, freedom) for g in gains]
        at = float(np.interp(least(), scores, gains)) / (5.0 * variance)
        chance = math.exp(log_survival_f(at / 3.0, 3, freedom)) * places
        assert -2.0 * math.log(chance) == pytest.approx(least(), rel=5e-3)
    # A variance that is claimed is no smaller for having been seen smaller.
    assert surprise(50.0, 3, 1.0, 0.01, 100.0) == surprise(50.0, 3)
