"""Effects of all flights together: on made-up measurements, where the truth is known."""

import numpy as np
import pytest

from onboard.core.diagnosis.together import Asked, Told, undecided_together
from onboard.core.diagnosis.undecided import left_open

SIX = np.array([1.01, 0.99, 1.02, 0.2, -0.1, 0.3])
PRIOR = np.full(6, 10.0)
EFFECT_PRIOR = np.full(2, 1.0)


def flight(rng, e, *, rows=400, found=False, counts=True):
    """One that measures the six, and an effect e (2,) whose columns look much like two of them."""
    h = rng.normal(size=(rows, 6))
    g = 0.7 * h[:, :2] + 0.2 * rng.normal(size=(rows, 2))
    y = h @ SIX + g @ e + rng.normal(size=rows)
    hh, hg, gg = h.T @ h, h.T @ g, g.T @ g
    back = np.linalg.solve(hh, hg)
    information = gg - hg.T @ back
    vector = g.T @ y - back.T @ (h.T @ y)
    moves = np.zeros((6, 2)) if found else -back
    asked = Asked("loop", "It lags", information, vector, EFFECT_PRIOR, moves)
    return Told([asked], hh if counts else np.zeros((6, 6))), hh, h.T @ y


def mean_of(flights):
    return np.linalg.solve(sum(f[1] for f in flights), sum(f[2] for f in flights))


def test_what_all_flights_ask_for_is_what_their_mean_is_off_by():
    rng = np.random.default_rng(1)
    flights = [flight(rng, np.array([0.5, -0.4])) for _ in range(12)]
    (model,) = undecided_together([f[0] for f in flights], PRIOR)
    error = mean_of(flights) - SIX
    sigma = np.sqrt(np.diag(np.linalg.inv(sum(f[1] for f in flights))))
    assert model.effect == "loop"
    assert model.share > 0.99
    assert np.abs(error / sigma).max() > 8.0
    assert -model.moves[:2] == pytest.approx(error[:2], rel=0.3)
    claimed = np.sqrt(np.diag(left_open([model])) + sigma**2)
    assert np.all(np.abs(error) < 2.5 * claimed)


def test_no_single_one_of_them_would_say_so():
    rng = np.random.default_rng(1)
    shares = []
    for _ in range(12):
        models = undecided_together([flight(rng, np.array([0.1, -0.08]), rows=100)[0]], PRIOR)
        shares += [m.share for m in models]
    assert len(shares) < 6
    assert max(shares, default=0.0) < 0.5


def test_flights_without_it_leave_it_out():
    """Once in a hundred sets of flights is one that chance has made."""
    said = 0
    for seed in range(100):
        rng = np.random.default_rng([2, seed])
        said += bool(undecided_together([flight(rng, np.zeros(2))[0] for _ in range(6)], PRIOR))
    assert said <= 5


def test_what_each_flight_has_another_size_of_is_none_of_all():
    rng = np.random.default_rng(3)
    flights = [flight(rng, 0.5 * rng.choice([-1.0, 1.0], 2)) for _ in range(12)]
    assert all(m.share < 0.3 for m in undecided_together([f[0] for f in flights], PRIOR))


def test_a_flight_that_has_it_in_its_model_speaks_for_it_and_is_not_off():
    rng = np.random.default_rng(4)
    e = np.array([0.5, -0.4])
    shown = [flight(rng, e, rows=4000, found=True)[0]]
    others = [flight(rng, e, rows=40)[0] for _ in range(3)]
    (model,) = undecided_together([*shown, *others], PRIOR)
    (alone,) = undecided_together([*[Told(t.effects, 0.0 * t.six) for t in shown], *others], PRIOR)
    assert model.share > 0.99
    # Most of what is known of the six is of the one that is right.
    assert np.abs(model.moves[:2]).max() < 0.1 * np.abs(alone.moves[:2]).max()


def test_numbers_of_another_unit_move_with_it():
    rng = np.random.default_rng(5)
    told = [flight(rng, np.array([0.5, -0.4]))[0] for _ in range(6)]
    T = np.diag([1.1, 0.9, 1.0, 1.0, 1.2, 1.0])
    back = np.linalg.inv(T)
    turned = [Told([a.of_raw(T) for a in t.effects], back.T @ t.six @ back) for t in told]
    ((one,), (other,)) = (undecided_together(x, PRIOR * 1e3) for x in (told, turned))
    np.testing.assert_allclose(other.moves, T @ one.moves, rtol=1e-6, atol=1e-9)


def test_what_is_certain_overflows_nothing_and_stands_in_the_way_of_nothing():
    """Odds grow with every flight; what each flight has in its model is no other model of it."""
    rng = np.random.default_rng(6)
    big = [flight(rng, np.array([30.0, -20.0]), rows=4000) for _ in range(6)]
    (alone,) = undecided_together([f[0] for f in big], PRIOR)
    assert alone.share == pytest.approx(1.0)
    known = [flight(rng, np.array([30.0, -20.0]), rows=4000, found=True)[0] for _ in range(6)]
    both = []
    for (told, *_), other in zip(big, known, strict=True):
        (asked,) = other.effects
        named = Asked("antenna", "It is elsewhere", *astuple_of(asked))
        both.append(Told([*told.effects, named], told.six))
    (beside,) = undecided_together(both, PRIOR)
    assert (beside.effect, beside.share) == ("loop", pytest.approx(1.0))


def astuple_of(asked):
    return asked.information, asked.vector, asked.prior, asked.moves
