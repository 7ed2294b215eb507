"""Fits on sums against dense least squares on the rows that they are the sums of."""

import numpy as np
import pytest

from onboard.core.diagnosis.block_jumps import OFFSETS, jumps_of_blocks, stepped
from onboard.core.diagnosis.limits import SETTLED_S
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.limits import FOLDS
from onboard.core.estimate.pool import Pool
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model, Unknown
from onboard.core.physics.effects.bias_step import LARGEST
from tests.core.diagnosis.problems import BLOCK_S, Columns, Problem, drawn, least_squares

JUMP_SIGMA = LARGEST


@pytest.fixture
def problem():
    """Six, and physics whose priors are neither centred on nothing nor loose."""
    families = [Columns("a", 3, prior=0.4, sigma=0.05), Columns("b", 1), Columns("c", 2, -1.0, 0.3)]
    rng = np.random.default_rng(11)
    return drawn(rng, families, rng.normal(size=12))


@pytest.fixture
def absent(problem):
    """Values that mean *not in the model*, where the linearisation has taken some of it in."""
    return np.random.default_rng(2).normal(scale=0.3, size=problem.model.size)


SUBSETS = [range(6), [*range(6), 9], [9, 2, 5, 6, 7, 8, 0], range(12)]


@pytest.mark.parametrize("free", SUBSETS)
def test_a_subset_is_fitted_as_dense_least_squares_fits_it(problem, absent, free):
    fitter = problem.fitter(absent)
    fit = fitter.fit(free)
    theta, chi2, covariance = least_squares(problem, free, absent)
    np.testing.assert_allclose(fit.theta, theta, rtol=1e-9, atol=1e-12)
    assert fit.chi2 == pytest.approx(chi2, rel=1e-9)
    index = list(free)
    fitter.pool = Pool(1.0)  # noise that is as the sums say
    everything = fitter.covariance(fit)
    got = everything[np.ix_(index, index)]
    np.testing.assert_allclose(got, covariance, rtol=1e-8, atol=1e-14)
    rest = np.setdiff1d(np.arange(problem.model.size), index)
    assert not everything[rest].any()
    np.testing.assert_array_equal(fit.theta[rest], absent[rest])


def test_what_is_not_fitted_stays_where_it_is_held(problem, absent):
    free, held = [*range(6), 9], absent + 0.2
    theta, chi2, _ = least_squares(problem, free, held)
    fit = problem.fitter(absent).fit(free, held)
    np.testing.assert_allclose(fit.theta, theta, rtol=1e-9)
    assert fit.chi2 == pytest.approx(chi2, rel=1e-9)


@pytest.mark.parametrize("blocks", [2, 5, 8, 21])
def test_held_out_rows_are_those_of_folds_that_the_fit_has_not_seen(blocks):
    rng = np.random.default_rng(blocks)
    p = drawn(rng, [Columns("a", 2)], rng.normal(size=8), blocks=blocks, rows=30)
    free, at = [*range(6), 7], np.zeros(8)
    missed, thetas = 0.0, {}
    for fold in np.array_split(np.arange(blocks), min(FOLDS, blocks)):
        seen = np.setdiff1d(np.arange(blocks), fold)
        rows = p.h[seen].reshape(-1, 8), p.y[seen].ravel()
        theta = least_squares(p, free, at, rows)[0]
        thetas |= dict.fromkeys(fold.tolist(), theta)
        missed += float(np.sum((p.y[fold] - p.h[fold] @ theta) ** 2))
    fitter = p.fitter()
    fit = fitter.fit(free)
    assert fit.held_out == pytest.approx(missed, rel=1e-9)
    assert fitter.held_rms(fit) == pytest.approx(np.sqrt(missed / p.y.size))
    members = [fitter.held_fits(free)[k][0] for k in range(len(fitter.held_fits(free)))]
    np.testing.assert_array_equal(np.concatenate(members), np.arange(blocks))
    for fold, theta in fitter.held_fits(free):
        for i in fold:
            np.testing.assert_allclose(theta, thetas[int(i)], rtol=1e-8, atol=1e-10)


def test_one_block_holds_nothing_out(problem):
    alone = Fitter(problem.blocks[:1], problem.model)
    assert alone.fit(range(6)).held_out == 0.0
    assert alone.held_fits(range(6)) == []
    assert np.isnan(problem.fitter().fit(range(6), held_out=False).held_out)


def test_gain_is_the_quadratic_form_of_what_the_new_columns_take_up(problem, absent):
    """Without a second fit: Frisch and Waugh's residuals of the new columns on the old ones."""
    base, new = list(range(6)), [6, 7, 8]
    fitter = problem.fitter(absent)
    gain = fitter.gain(fitter.fit(base), fitter.fit([*base, *new]))
    h, y = problem.rows
    model = problem.model
    # What comes in leaves its absent value and pays for leaving its prior's centre.
    others = np.setdiff1d(np.arange(model.size), base + new)
    y = y - h[:, others] @ absent[others] - h[:, base] @ model.prior[base]
    before = np.concatenate([y - h[:, new] @ absent[new], np.zeros(9)])
    after = np.concatenate([y - h[:, new] @ model.prior[new], np.zeros(9)])
    rows = np.vstack([h[:, base + new], np.diag(1.0 / model.prior_sigma[base + new])])
    old, added = rows[:, :6].copy(), rows[:, 6:]
    Q = np.linalg.qr(old)[0]

    def left(x):
        return x - Q @ (Q.T @ x)

    D, r = left(added), left(after)
    taken = r @ D @ np.linalg.solve(D.T @ D, D.T @ r)
    expected = left(before) @ left(before) - (r @ r - taken)
    assert gain == pytest.approx(expected, rel=1e-8)


def test_a_column_whose_absent_value_is_its_priors_centre_never_loses(problem):
    at = problem.model.prior.copy()
    fitter = problem.fitter(at)
    before = fitter.fit(range(6))
    gains = [fitter.gain(before, fitter.fit([*range(6), *new])) for new in ([6], [6, 7], [6, 7, 9])]
    assert 0.0 <= gains[0] <= gains[1] <= gains[2]


def test_held_gain_and_residuals_are_in_the_units_of_whitened_rows(problem):
    fitter = problem.fitter()
    small, large = fitter.fit(range(6)), fitter.fit(range(12))
    h, y = problem.rows
    assert fitter.rms(large) == pytest.approx(np.sqrt(np.mean((y - h @ large.theta) ** 2)))
    assert fitter.held_gain(small, large) == pytest.approx(small.held_out - large.held_out)
    assert fitter.log_rows == pytest.approx(np.log(len(y)))


def test_known_noise_in_the_regressors_does_not_weaken_an_estimate():
    """Errors in variables: with the noise's own Gram the estimate is that of clean columns."""
    rng = np.random.default_rng(4)
    truth = np.array([1.0, 0.9, 1.1, 0.2, -0.1, 0.3, 2.0])
    clean = drawn(rng, [Columns("a", 1)], truth, blocks=20, rows=2000, noise=0.1)
    sigma = 0.7
    h = clean.h.copy()
    h[..., 6] += sigma * rng.normal(size=h.shape[:2])
    noisy = Problem(clean.model, h, clean.y)
    blocks = noisy.blocks
    blocks = [with_noise(block, {6: h.shape[1] * sigma**2}) for block in blocks]
    kept = Fitter(blocks, clean.model).fit(range(7)).theta[6]
    weakened = noisy.fitter().fit(range(7)).theta[6]
    assert weakened == pytest.approx(2.0 / (1.0 + sigma**2), rel=0.03)
    assert kept == pytest.approx(2.0, rel=0.03)


def with_noise(block, known):
    """A block that knows how much of some regressors is noise."""
    sums = block.sums
    for i, much in known.items():
        sums.G[i, i] = much
    return Block(block.start, block.end, sums)


# -- jumps of the offsets ---------------------------------------------------------------------


def jumped(problem, boundary):
    """The problem with regressors of a jump written out: offsets' columns, nothing before it."""
    after = np.arange(len(problem.y))[:, None, None] >= boundary
    wide = np.concatenate([problem.h, problem.h[..., OFFSETS] * after], axis=-1)
    family = Columns("jump", 0)
    family.unknowns = tuple(Unknown(f"jump_{i}", "m/s^2", 0.0, LARGEST) for i in range(3))
    return Problem(Model([*problem.model.families, family]), wide, problem.y)


@pytest.mark.parametrize("boundary", [1, 4, 9])
def test_stepped_sums_are_those_of_regressors_that_begin_at_the_block(problem, absent, boundary):
    made_so = stepped(problem.fitter(absent), boundary)
    written = jumped(problem, boundary)
    wide = np.concatenate([absent, np.zeros(3)])
    np.testing.assert_array_equal(made_so.absent, wide)
    for got, made in zip(made_so.blocks, written.blocks, strict=True):
        np.testing.assert_allclose(got.sums.N, made.sums.N, atol=1e-9)
        np.testing.assert_allclose(got.sums.b, made.sums.b, atol=1e-9)
        assert got.sums.s == made.sums.s
    free = [*range(6), 9, 12, 13, 14]
    theta, chi2, _ = least_squares(written, free, wide)
    fit = made_so.fit(free)
    np.testing.assert_allclose(fit.theta, theta, rtol=1e-8, atol=1e-11)
    assert fit.chi2 == pytest.approx(chi2, rel=1e-9)


@pytest.mark.parametrize("free", [range(6), [*range(6), 6, 7, 8, 9]])
def test_jumps_are_scored_as_if_each_had_been_fitted(problem, absent, free):
    scored = jumps_of_blocks(problem.fitter(absent), free)
    settled = [i for i in range(1, len(problem.y)) if BLOCK_S * i >= SETTLED_S]
    assert sorted(i for i, _ in scored) == settled
    without = least_squares(problem, free, absent)[1]
    wide = np.concatenate([absent, np.zeros(3)])
    for boundary, gain in scored:
        chi2 = least_squares(jumped(problem, boundary), [*free, 12, 13, 14], wide)[1]
        assert gain == pytest.approx(without - chi2, rel=1e-7, abs=1e-7)


def test_jumps_and_stepped_agree_where_regressors_are_noisy(problem):
    blocks = problem.blocks
    rng = np.random.default_rng(8)
    blocks = [with_noise(block, dict(enumerate(rng.uniform(0.5, 2.0, 3)))) for block in blocks]
    fitter = Fitter(blocks, problem.model)
    free = list(range(7))
    before = fitter.fit(free)
    for boundary, gain in jumps_of_blocks(fitter, free):
        after = stepped(fitter, boundary).fit([*free, 12, 13, 14])
        assert gain == pytest.approx(fitter.gain(before, after), rel=1e-7)


def test_a_jump_gains_most_where_it_is(problem):
    at, size = 6, np.array([0.4, -0.3, 0.2])
    y = problem.y.copy()
    y[at:] += problem.h[at:][..., OFFSETS] @ size
    moved = Problem(problem.model, problem.h, y).fitter()
    free = list(range(12))
    best = max(jumps_of_blocks(moved, free), key=lambda x: x[1])
    assert best[0] == at
    fit = stepped(moved, at).fit([*free, 12, 13, 14])
    sigma = np.sqrt(np.diag(stepped(moved, at).covariance(fit))[12:])
    assert np.all(np.abs(fit.theta[12:] - size) < 4.0 * sigma)


# -- how much blocks contradict each other ----------------------------------------------------


def contradicting(seed=3):
    """What the last unknown does looks like the first offset, each block with its own sign."""
    rng = np.random.default_rng(seed)
    theta = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    p = drawn(rng, [Columns("a", 1)], theta, blocks=12, rows=100)
    h = p.h.copy()
    h[..., 6] = 0.7 * h[..., 3] * np.where(np.arange(12) % 2, 1.0, -1.0)[:, None]
    return Problem(p.model, h, h @ theta + rng.normal(size=p.y.shape))


def test_blocks_contradict_each_other_only_without_what_tells_them_apart():
    problem = contradicting()
    told = problem.fitter()
    assert told.pool.variance < 1.5
    six = [Problem(Model([problem.model.families[0]]), problem.h[..., :6], problem.y)]
    untold = six[0].fitter()
    assert untold.pool.freedom < 20.0
    fit = untold.fit(range(6))
    plain = np.linalg.inv(untold.sums.N)
    inflated = np.diag(untold.covariance(fit)) / np.diag(plain)
    # The offset that is pulled to and fro, and no other number of the flight.
    assert inflated[3] > 20.0
    assert np.all(np.delete(inflated, 3) < 5.0)


def test_a_gain_is_weakened_by_what_contradicts_it_and_not_by_what_else_does():
    """Two effects explain as much; along one of them blocks scatter."""
    rng = np.random.default_rng(8)
    blocks, rows = 20, 80
    p = drawn(rng, [Columns("a", 1), Columns("b", 1)], np.zeros(8), blocks=blocks, rows=rows)
    wild = 0.5 * rng.normal(size=(blocks, 1))
    y = rng.normal(size=p.y.shape) + 0.3 * p.h[..., 7] + (0.3 + wild) * p.h[..., 6]
    fitter = Problem(p.model, p.h, y).fitter()
    after = fitter.fit(range(8))
    worth = [
        fitter.gain_by([i], fitter.fit([k for k in range(8) if k != i]), after) for i in (6, 7)
    ]
    assert worth[0].variance > 5.0 * worth[1].variance
    # As much as the unknown's variance between blocks makes of it: 80 rows of unit columns.
    assert worth[0].variance == pytest.approx(1.0 + rows * 0.25, rel=0.6)
    assert worth[1].variance < 3.0


def test_it_takes_blocks_as_they_are(problem):
    before = [NormalSums.to_bytes(p.sums) for p in problem.blocks]
    blocks = problem.blocks
    fitter = Fitter(blocks, problem.model)
    fitter.fit(range(12))
    jumps_of_blocks(fitter, range(6))
    stepped(fitter, 3)
    fitter.covariance(fitter.fit(range(6)))
    assert all(isinstance(p, Block) for p in blocks)
    assert [p.sums.to_bytes() for p in blocks] == before
