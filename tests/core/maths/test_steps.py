"""Steps in wandering noise: the filter's algebra is exact, sizes hold, chance is no step."""

import math

import numpy as np
import pytest

from onboard.core.maths import steps
from onboard.core.maths.chi_square import log_survival
from onboard.core.maths.steps import _Grid, steps_in

N = 90


def wandering(rng, n, share, constant):
    """(n,) of unit variance: white, and a Gauss-Markov process of so many samples."""
    keep = math.exp(-1.0 / constant)
    slow = np.empty(n)
    slow[0] = rng.normal()
    for i in range(1, n):
        slow[i] = keep * slow[i - 1] + math.sqrt(1.0 - keep**2) * rng.normal()
    return math.sqrt(share) * slow + math.sqrt(1.0 - share) * rng.normal(size=n)


def columns(rng, n):
    return np.column_stack([np.ones(n), np.linspace(-0.5, 0.5, n), rng.normal(size=n)])


WIDE = np.full(3, 1e-4)


def test_what_a_step_becomes_in_the_filter_is_what_is_said_of_it():
    rng = np.random.default_rng(1)
    grid = _Grid.over(N)
    white = grid.whitened(rng.normal(size=(N, 2)))
    step, pulse, both, (along, nudge) = grid.stepped(white)
    for i in (2, 17, N - 1):
        one = np.zeros((N, 2))
        one[i:, 0] = 1.0
        one[i - 1, 1] = 1.0
        made = grid.whitened(one)
        assert np.einsum("gn,gn->g", made[..., 0], made[..., 0]) == pytest.approx(step[:, i])
        assert np.einsum("gn,gn->g", made[..., 1], made[..., 1]) == pytest.approx(pulse[:, i])
        assert np.einsum("gn,gn->g", made[..., 0], made[..., 1]) == pytest.approx(both[:, i])
        assert np.einsum("gn,gnk->gk", made[..., 0], white) == pytest.approx(along[:, i])
        assert np.einsum("gn,gnk->gk", made[..., 1], white) == pytest.approx(nudge[:, i])


def test_innovations_are_white_for_each_process():
    """Against the covariance of the process, dense: away from the beginning they are white."""
    grid = _Grid.over(N)
    through = np.swapaxes(grid.whitened(np.eye(N)), 0, 1).swapaxes(0, 1)
    lags = np.abs(np.subtract.outer(np.arange(N), np.arange(N)))
    for g in range(len(grid.keep)):
        # Autocovariance of the ARMA(1, 1), from its infinite moving average.
        weights = np.concatenate(
            [[1.0], (grid.keep[g] - grid.back[g]) * grid.keep[g] ** np.arange(4000)]
        )
        scale = float(np.sum(weights**2))
        covariance = np.array([np.sum(weights[k:] * weights[: len(weights) - k]) for k in range(N)])
        made = through[g] @ (covariance[lags] / scale) @ through[g].T
        late = made[N // 2 :, N // 2 :]
        assert late == pytest.approx(np.eye(len(late)) * grid.sigma[g] ** 2, abs=2e-2)


@pytest.mark.parametrize(("share", "constant"), [(0.0, 1.0), (0.5, 5.0), (0.9, 30.0)])
def test_sizes_are_within_what_is_claimed(share, constant):
    rng = np.random.default_rng(2)
    off = []
    for _ in range(60):
        H, at = columns(rng, N), int(rng.integers(20, 70))
        y = wandering(rng, N, share, constant) + H @ [3.0, 1.0, -2.0]
        y[at:] += 4.0
        found = steps_in(y, H, WIDE)
        off.append((found.size[at] - 4.0) / math.sqrt(found.variance[at]))
    # Noise that is found from ninety samples is known to a third where it wanders slowly.
    assert np.sqrt(np.mean(np.square(off))) < 1.45
    assert abs(np.mean(off)) < 0.5


def test_the_window_in_which_it_begins_may_have_any_share_of_it():
    rng = np.random.default_rng(3)
    H = columns(rng, N)
    y = 0.01 * rng.normal(size=N)
    y[40:] += 1.0
    y[39] += 0.3
    found = steps_in(y, H, WIDE)
    at = int(np.argmax(found.gain))
    assert at == 40
    assert found.size[at] == pytest.approx(1.0, abs=0.02)
    assert found.before[at] == pytest.approx(0.3, abs=0.05)


def test_one_odd_sample_is_no_step():
    rng = np.random.default_rng(4)
    H = columns(rng, N)
    y = 0.01 * rng.normal(size=N)
    y[40] += 1.0
    assert steps_in(y, H, WIDE).gain[3:-3].max() < 12.0


@pytest.mark.parametrize(("share", "constant"), [(0.0, 1.0), (0.5, 5.0), (0.5, 30.0), (0.97, 50.0)])
def test_of_noise_alone_few_are_said_to_step(share, constant):
    """One in twenty nominally; noise that is hard to know doubles or triples it, no more."""
    rng = np.random.default_rng(5)
    said = 0
    for _ in range(100):
        found = steps_in(wandering(rng, N, share, constant), columns(rng, N), WIDE)
        best = float(found.gain[3:-3].max())
        said += log_survival(best, 1) + math.log(N - 6) < math.log(0.05)
    assert said <= 22  # of a true rate of 15 %, exceeded once in fifty


def test_units_do_not_matter():
    rng = np.random.default_rng(6)
    H, y = columns(rng, N), wandering(rng, N, 0.5, 5.0)
    y[30:] += 2.0
    one, other = steps_in(y, H, WIDE * 0.0), steps_in(1e-3 * y, H, WIDE * 0.0)
    inside = slice(3, -3)
    assert other.gain[inside] == pytest.approx(one.gain[inside], abs=1e-6)
    assert other.size[inside] == pytest.approx(1e-3 * one.size[inside])
    assert other.variance[inside] == pytest.approx(1e-6 * one.variance[inside])


def test_a_long_series_is_judged_by_what_is_around(monkeypatch):
    rng = np.random.default_rng(7)
    n = 400
    H = np.ones((n, 1))
    y = 0.1 * rng.normal(size=n)
    y[250:] += 1.0
    whole = steps_in(y, H, WIDE[:1])
    monkeypatch.setattr(steps, "LONGEST", 160)
    parts = steps_in(y, H, WIDE[:1])
    # A step from 250 on is one from 251 on, the sample before it being whole.
    assert {int(np.argmax(parts.gain)), int(np.argmax(whole.gain))} <= {250, 251}
    assert parts.size[250] == pytest.approx(whole.size[250], abs=0.05)
    # The moments of every part are there, each once: far from the step nothing is found.
    quiet = np.r_[3:150, 350:397]
    assert np.all(np.isfinite(parts.size))
    assert parts.gain[quiet].max() < 20.0


def test_two_that_are_the_same_have_no_step():
    found = steps_in(np.zeros(N), np.ones((N, 1)), WIDE[:1], 1e-4)
    assert np.all(found.gain == pytest.approx(0.0, abs=1e-6))
    assert np.all(np.isfinite(found.size))
