"""The solution of block sums against dense least squares, which knows no sums."""

import numpy as np
import pytest

from onboard.core.estimate.solution import held_out, solve
from onboard.core.maths.blocks import Block, merged
from onboard.core.maths.sums import BankSums
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Model

M = 6
TRUTH = np.array([1.02, 0.98, 1.01, 0.2, -0.1, 0.3])
MODEL = Model([Six()])


def block(k, h, y):
    sums = BankSums(1, M)
    sums.add(y[None], h[None], np.zeros(1))
    return Block(10.0 * k, 10.0 * (k + 1), sums.member(0))


def blocks_of(h, y, count):
    pieces = zip(np.split(h, count), np.split(y, count), strict=True)
    return [block(k, *piece) for k, piece in enumerate(pieces)]


def flight(seed, n, noise):
    rng = np.random.default_rng(seed)
    h = 5.0 * rng.normal(size=(n, M))
    return h, h @ TRUTH + noise * rng.normal(size=n)


def with_prior(h, y):
    """The prior as six more measurements: (n + 6, m) and (n + 6,)."""
    return (
        np.vstack([h, np.diag(1.0 / MODEL.prior_sigma)]),
        np.concatenate([y, MODEL.prior / MODEL.prior_sigma]),
    )


def test_the_solution_is_generalised_least_squares():
    """Measurements with a dense covariance, whitened and summed, against its inverse."""
    rng = np.random.default_rng(1)
    n = 60
    root = np.tril(rng.normal(size=(n, n))) / np.sqrt(n) + np.eye(n)
    S = root @ root.T
    H = rng.normal(size=(n, M))
    z = H @ TRUTH + 0.5 * root @ rng.normal(size=n)
    L = np.linalg.cholesky(S)
    got = solve([block(0, np.linalg.solve(L, H), np.linalg.solve(L, z))], MODEL)
    weight, prior = np.linalg.inv(S), np.diag(1.0 / MODEL.prior_sigma**2)
    A = H.T @ weight @ H + prior
    np.testing.assert_allclose(
        got.theta, np.linalg.solve(A, H.T @ weight @ z + prior @ MODEL.prior), rtol=1e-10
    )
    # Half the noise that was claimed: no reason to doubt.
    assert got.variance_inflation == pytest.approx(1.0)
    np.testing.assert_allclose(got.covariance, np.linalg.inv(A), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(got.information, H.T @ weight @ H, rtol=1e-6, atol=1e-9)


def test_noise_larger_than_claimed_inflates_the_variance_by_its_square():
    h, y = flight(2, 4000, noise=3.0)
    got = solve(blocks_of(h, y, 4), MODEL)
    assert got.variance_inflation == pytest.approx(9.0, rel=0.1)
    assert got.nis == pytest.approx(9.0, rel=0.1)
    dense = np.linalg.inv(h.T @ h / got.nis + np.diag(1.0 / MODEL.prior_sigma**2))
    np.testing.assert_allclose(got.covariance, dense, rtol=1e-9)


def test_an_offset_that_changes_half_way_inflates_its_own_variance():
    """And no other's: what contradicts itself is one number of six."""
    n, count = 240, 8
    h, y = flight(3, n, noise=1.0)
    y = y + np.where(np.arange(n) < n // 2, 1.0, -1.0) * h[:, 4] * 0.3
    got = solve(blocks_of(h, y, count), MODEL)
    plain = np.linalg.inv(h.T @ h + np.diag(1.0 / MODEL.prior_sigma**2))
    inflated = np.diag(got.covariance) / np.diag(plain)
    assert inflated[4] > 20.0
    assert np.all(np.delete(inflated, 4) < 5.0)
    assert got.variance_inflation > 20.0


def test_white_noise_inflates_nothing_beyond_chance():
    inflation = [
        solve(blocks_of(*flight(s, 240, 1.0), 8), MODEL).variance_inflation for s in range(100)
    ]
    assert np.median(inflation) < 1.15
    assert np.mean(np.array(inflation) > 2.5) < 0.05


def test_noise_in_the_regressors_is_taken_out():
    """Errors in variables: least squares shrinks what is multiplied by noise, the solution not."""
    rng = np.random.default_rng(5)
    n, noise = 20_000, 1.0
    true = 2.0 * rng.normal(size=(n, M))
    read = true.copy()
    read[:, 0] += noise * rng.normal(size=n)
    y = true @ TRUTH + rng.normal(size=n)
    naive = np.linalg.lstsq(read, y, rcond=None)[0]
    assert naive[0] == pytest.approx(TRUTH[0] * 4.0 / (4.0 + noise**2), rel=0.02)
    one = block(0, read, y)
    sums = one.sums
    sums.G[0, 0] = n * noise**2
    one = Block(one.start, one.end, sums)
    wide = Model([Six(scale_sigma=10.0, beta_sigma=10.0)])
    assert solve([one], wide).theta[0] == pytest.approx(TRUTH[0], abs=0.02)


def test_held_out_residuals_are_those_of_fits_that_have_not_seen_them():
    n, count = 240, 8
    h, y = flight(6, n, noise=1.0)
    square = 0.0
    for rows in np.split(np.arange(n), count):
        rest = np.setdiff1d(np.arange(n), rows)
        theta = np.linalg.lstsq(*with_prior(h[rest], y[rest]), rcond=None)[0]
        square += float(np.sum((y - h @ theta)[rows] ** 2))
    assert held_out(blocks_of(h, y, count), MODEL) == pytest.approx(np.sqrt(square / n), rel=1e-9)


def test_held_unknowns_are_not_fitted():
    n, count = 240, 8
    h, y = flight(7, n, noise=1.0)
    fixed = dict(enumerate(MODEL.prior))
    expected = np.sqrt(np.mean((y - h @ MODEL.prior) ** 2))
    assert held_out(blocks_of(h, y, count), MODEL, fixed) == pytest.approx(expected, rel=1e-9)


def test_merging_blocks_keeps_the_flight():
    blocks = blocks_of(*flight(8, 240, 1.0), 24)
    fewer = merged(blocks, 5)
    assert len(fewer) <= 5
    assert (fewer[0].start, fewer[-1].end) == (blocks[0].start, blocks[-1].end)
    assert sum(b.sums.rows for b in fewer) == 240
    np.testing.assert_allclose(sum(b.sums.N for b in fewer), sum(b.sums.N for b in blocks))
