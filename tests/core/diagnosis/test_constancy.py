"""What is taken for one number of a flight is asked to be one in its parts."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.constancy import Constant, Growth, Pieces, changes
from onboard.core.maths.blocks import Block
from onboard.core.maths.chi_square import survival
from onboard.core.maths.sums import NormalSums
from tests.core.diagnosis.problems import BLOCK_S, Columns, Problem, drawn

BLOCKS = 16
ROWS = 60
MATTERS = 0.1
FAMILIES = (Columns("late", 1), Columns("place", 3), Columns("rate", 1))
T = BLOCK_S * (np.arange(BLOCKS) + 0.5)


def flight(seed, late=0.0, place=0.0, noise=1.0):
    """Rows of a flight; ``late`` and the second of ``place`` are arrays over blocks or numbers."""
    rng = np.random.default_rng(seed)
    made = drawn(rng, FAMILIES, np.zeros(11), blocks=BLOCKS, rows=ROWS, noise=noise)
    y = made.y + made.h[:, :, 6] * np.broadcast_to(late, BLOCKS)[:, None]
    return replace(made, y=y + made.h[:, :, 8] * np.broadcast_to(place, BLOCKS)[:, None])


def asked(made, **stated):
    """The constants that are in question."""
    late = Constant("late", made.columns("late"), 0.0, MATTERS, **stated)
    return [late, Constant("place", made.columns("place"), 0.0, MATTERS)]


def told(made, **stated):
    return changes(made.blocks, made.model, asked(made, **stated))


def dense(made, own, parts):
    """Rows with columns of their own in each part for ``own``, and the misfit with and without."""
    h, y = made.rows
    P = len(parts)
    split = np.zeros((len(y), P * len(own)))
    of_row = np.repeat(np.arange(BLOCKS), ROWS)
    for p, blocks in enumerate(parts):
        inside = np.isin(of_row, blocks)
        split[inside, p * len(own) : (p + 1) * len(own)] = h[inside][:, own]
    rest = [i for i in range(made.model.size) if i not in own]
    return np.hstack([h[:, rest], split]), h, y


def misfit(h, y):
    return float(np.sum((y - h @ np.linalg.lstsq(h, y, rcond=None)[0]) ** 2))


@pytest.mark.parametrize("parts", [2, 4, BLOCKS])
@pytest.mark.parametrize("name", ["late", "place"])
def test_the_gain_is_what_least_squares_gains_by_columns_of_each_part(name, parts):
    made = flight(1, late=0.3 * np.sin(T), place=np.linspace(0.0, 0.5, BLOCKS))
    own = made.columns(name)
    gain, freedom = Pieces.of(made.blocks, made.model).joined(parts).gain(own, 0.0, 1.0)
    fuller, plain, y = dense(made, list(own), np.array_split(np.arange(BLOCKS), parts))
    assert freedom == len(own) * (parts - 1)
    # The prior of ten sigma is in one of the two, and next to nothing.
    assert gain == pytest.approx(misfit(plain, y) - misfit(fuller, y), rel=1e-3)


def test_values_of_each_part_are_those_of_least_squares():
    made = flight(2, place=0.4 * (T.mean() < T))
    own = made.columns("place")
    pieces = Pieces.of(made.blocks, made.model).joined(4)
    freed, values, sigmas = pieces.freed(own)
    fuller, _, y = dense(made, list(own), np.array_split(np.arange(BLOCKS), 4))
    x = np.linalg.lstsq(fuller, y, rcond=None)[0]
    variance = np.diag(np.linalg.inv(fuller.T @ fuller))
    assert values.ravel() == pytest.approx(x[-12:], abs=2e-3)
    assert sigmas.ravel() == pytest.approx(np.sqrt(variance[-12:]), rel=1e-3)
    assert freed.square == pytest.approx(misfit(fuller, y), rel=1e-3)
    assert freed.rows == pytest.approx(BLOCKS * ROWS - 12, abs=0.1)


def test_of_what_is_all_noise_no_part_claims_the_prior_that_all_have_once():
    """Of each part alone the noise is more than there is; sigmas of all of them are numbers."""
    made = flight(3)
    made.h[..., 10] *= 1e-3  # so little that its prior knows more
    noisy = []
    for block in made.blocks:
        G = np.zeros_like(block.sums.N)
        G[10, 10] = 2.0 * block.sums.N[10, 10]
        of = block.sums
        sums = NormalSums(of.N, of.b, G, of.residual(np.zeros(len(G))), of.rows)
        noisy.append(Block(block.start, block.end, sums))
    pieces = Pieces.of(noisy, made.model)
    assert np.all(np.linalg.eigvalsh(pieces.N.sum(axis=0) + np.diag(pieces.prior)) > 0.0)
    for own in ((6,), (7, 8, 9), (10,)):
        assert np.all(pieces.freed(own)[2] > 0.0)
        assert np.all(np.isfinite(pieces.apart(own)))


def test_by_chance_the_gain_is_chi_square():
    """Of one that is the same all flight long, and whatever it is."""
    p = []
    for seed in range(150):
        made = flight(seed, late=0.7, place=-2.0)
        pieces = Pieces.of(made.blocks, made.model)
        gain, freedom = pieces.joined(4).gain(made.columns("place"), 0.0, 1.0)
        p.append(survival(gain, freedom))
    p = np.sort(p)
    # Kolmogorov and Smirnov: once in a thousand times it is further off.
    assert np.abs(p - (np.arange(150) + 0.5) / 150).max() < 1.95 / np.sqrt(150)


def test_what_may_differ_from_part_to_part_all_the_same_gains_as_chance_does():
    rng = np.random.default_rng(7)
    gains = {0.0: [], 0.5: []}
    for seed in range(40):
        made = flight(seed, late=0.5 * rng.normal(size=BLOCKS))
        pieces = Pieces.of(made.blocks, made.model)
        for floor, out in gains.items():
            out.append(pieces.gain(made.columns("late"), floor, 1.0)[0] / (BLOCKS - 1))
    assert np.mean(gains[0.5]) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / (40 * (BLOCKS - 1))))
    assert np.mean(gains[0.0]) > 5.0


@pytest.mark.parametrize("noise", [1.0, 1.8])
def test_of_flights_whose_constants_are_constant_nothing_is_told(noise):
    """Nor where the noise is larger than the sums say, as far as the six are believed."""
    assert not any(told(flight(seed, 0.5, -1.0, noise)) for seed in range(60))


SHAPES = {
    "alternating": (T // (2.0 * BLOCK_S)) % 2.0,
    "stepping": T.mean() < T,
    "stepping early": T > 4.0 * BLOCK_S,
    "drifting": T / T[-1],
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", ["late", "place"])
def test_what_changes_is_told_by_its_name_and_how_large_it_is(name, shape):
    for seed in range(5):
        (change,) = told(flight(seed, **{name: 1.6 * SHAPES[shape]}))
        assert change.constant.effect == name
        a, b, axis = change.apart
        assert a < b
        assert axis == (1 if name == "place" else 0)
        true = [np.mean(x) for x in np.array_split(1.6 * SHAPES[shape], len(change.spans))]
        sigma = float(np.hypot(change.sigmas[a, axis], change.sigmas[b, axis]))
        assert change.size == pytest.approx(abs(true[a] - true[b]), abs=5.0 * sigma)
        assert change.size > 5.0 * sigma / 2.0  # they are given for twice the noise


def test_another_one_that_seems_to_change_with_it_is_not_blamed():
    for seed in range(5):
        made = flight(seed)
        h = made.h.copy()
        h[:, :, 6] = 0.8 * h[:, :, 8] + 0.6 * h[:, :, 6]
        bent = Problem(made.model, h, made.y + 1.5 * h[:, :, 8] * SHAPES["alternating"][:, None])
        pieces, late = Pieces.of(bent.blocks, bent.model), bent.columns("late")
        gain, freedom = pieces.gain(late, 0.0, 4.0)
        assert survival(gain, freedom) < 1e-6  # by itself it does seem to
        assert [c.constant.effect for c in told(bent)] == ["place"]


def test_what_changes_by_less_than_matters_is_not_told_however_sure():
    made = flight(3, late=0.5 * MATTERS * SHAPES["stepping"], noise=0.01)
    quiet = Problem(made.model, made.h * 100.0, made.y * 100.0)
    gain, freedom = Pieces.of(quiet.blocks, quiet.model).joined(2).gain((6,), 0.0, 4.0)
    assert survival(gain, freedom) < 1e-6
    assert told(quiet) == ()
    assert told(Problem(quiet.model, quiet.h, 4.0 * quiet.y))


def grown(seed, late):
    """A flight whose model lets what is late grow with time."""
    made = flight(seed, late)
    h = made.h.copy()
    h[:, :, 10] = h[:, :, 6] * T[:, None]
    return Problem(made.model, h, made.y)


def test_one_that_grows_as_its_model_lets_it_is_no_contradiction():
    growth = Growth(10, 0.0, 0.0)
    assert told(grown(4, late=0.02 * T), growth=growth) == ()


def test_one_that_steps_where_its_model_lets_it_grow_is_told_as_it_is():
    (change,) = told(grown(5, late=2.0 * SHAPES["stepping"]), growth=Growth(10, 0.0, 0.0))
    ends = change.values[[0, -1], 0]
    assert ends == pytest.approx([0.0, 2.0], abs=5.0 * change.sigmas[[0, -1], 0].max())


def test_one_block_says_nothing():
    made = flight(6, late=SHAPES["stepping"])
    assert changes(made.blocks[:1], made.model, asked(made)) == ()


def test_between_the_noise_there_is_and_the_noise_there_may_be_it_is_doubtful():
    """A larger change contradicts, and a smaller one is nothing."""
    stepping = [flight(8, late=size * SHAPES["stepping"]) for size in (0.0, 0.6, 2.0)]
    assert [[c.contradicts for c in told(made)] for made in stepping] == [[], [False], [True]]
