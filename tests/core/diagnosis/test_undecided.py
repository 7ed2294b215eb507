"""A model that is as likely as the one that is reported widens the sigmas of scale and offset."""

import functools

import numpy as np
import pytest

from benchmarks.concealing import Secret
from benchmarks.explaining import heard
from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.hypotheses import Choice
from onboard.core.diagnosis.limits import PRESENT
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.score import least
from onboard.core.diagnosis.undecided import left_open, log_odds, undecided
from tests.core.diagnosis.problems import Columns, Problem, drawn

ALIKE = 0.95
"""Of the effect's column, how much is like that of a scale."""


class Family:
    """Of the model that is reported, as far as it matters here."""

    effect = "effect"


def flight(seed, size):
    """Rows with an effect of some size, whose column is much like the first of the six."""
    rng = np.random.default_rng(seed)
    theta = np.zeros(7)
    made = drawn(rng, [Columns("effect", 1)], theta)
    h = made.h.copy()
    h[:, :, 6] = ALIKE * h[:, :, 0] + np.sqrt(1.0 - ALIKE**2) * h[:, :, 6]
    theta[6] = size
    return Problem(made.model, h, made.y + h @ theta)


def decided(problem, *, found):
    """The choice with the effect in the model, or left out; and the score that it has."""
    fitter = problem.fitter()
    candidate = Candidate("effect", problem.columns("effect"), (10.0,))
    base = list(range(6))
    choice = Choice(fitter, base, [candidate], [candidate] if found else [])
    score = candidate.score(fitter, fitter.fit(base), fitter.fit([*base, 6]))
    return choice, score


@functools.cache
def at_the_edge():
    """Flights whose effect is about as large as what counts as found."""
    made = [flight(seed, 0.6) for seed in range(600)]
    scored = [(problem, decided(problem, found=False)[1]) for problem in made]
    return [(problem, score) for problem, score in scored if abs(score - least()) < 8.0]


def test_what_counts_as_found_is_likely_and_what_chance_does_is_not():
    assert log_odds(least()) > np.log(5.0)
    scores = np.linspace(0.0, 60.0, 601)
    odds = np.exp([log_odds(s) for s in scores])
    assert np.all(np.diff(odds) >= 0.0)
    # Sellke, Bayarri and Berger: p = 0.05 is odds of 2.5 to 1, 0.001 of 53 to 1.
    even = PRESENT / (1.0 - PRESENT)
    assert np.exp(log_odds(-2.0 * np.log(0.05))) / even == pytest.approx(2.46, abs=0.01)
    assert np.exp(log_odds(-2.0 * np.log(0.001))) / even == pytest.approx(53.3, abs=0.1)


def test_a_model_has_the_share_of_its_odds():
    for problem, score in at_the_edge()[:60]:
        choice, _ = decided(problem, found=False)
        (model,) = undecided(choice, ())
        assert model.share == pytest.approx(1.0 / (1.0 + np.exp(-log_odds(score))))


@pytest.mark.parametrize("size", [0.0, 5.0], ids=["nothing", "plain to see"])
def test_what_is_decided_leaves_nothing_open(size):
    problem = flight(3, size)
    choice, _ = decided(problem, found=size > 0.0)
    more = left_open(undecided(choice, (Family(),)))
    assert more[0, 0] < 1e-3 * np.linalg.inv(problem.fitter().sums.N)[0, 0]


def test_sigmas_cover_what_either_model_says():
    """Of flights at the edge, many are far off without what is left open."""
    without, with_it = [], []
    for problem, score in at_the_edge():
        found = score >= least()
        choice, _ = decided(problem, found=found)
        fit = choice.fitter.fit(choice.free)
        index = list(choice.free)
        known = np.linalg.inv(choice.fitter.sums.N[np.ix_(index, index)])[0, 0]
        more = left_open(undecided(choice, (Family(),) if found else ()))[0, 0]
        without.append(abs(fit.theta[0]) / np.sqrt(known))
        with_it.append(abs(fit.theta[0]) / np.sqrt(known + more))
    assert np.mean(np.array(without) < 3.0) < 0.7
    assert np.mean(np.array(with_it) < 3.0) > 0.95


def test_what_was_chosen_and_then_not_needed_is_open_unless_something_else_is_there():
    class Shock:
        effect = "shock"  # which was not to be chosen from

    for problem, _ in at_the_edge()[:60]:
        (dropped,) = undecided(decided(problem, found=True)[0], ())
        (never,) = undecided(decided(problem, found=False)[0], ())
        assert dropped.effect == "effect"
        assert dropped.share == pytest.approx(never.share)
        np.testing.assert_allclose(dropped.moves, never.moves)
        assert undecided(decided(problem, found=True)[0], (Shock(),)) == []


def test_an_effect_in_the_place_of_another_is_a_model_too():
    rng = np.random.default_rng(5)
    made = drawn(rng, [Columns("effect", 1), Columns("other", 1)], np.zeros(8))
    h = made.h.copy()
    h[:, :, 6] = 0.6 * h[:, :, 0] + 0.8 * h[:, :, 6]
    h[:, :, 7] = 0.99 * h[:, :, 6] + 0.05 * h[:, :, 7] - 0.1 * h[:, :, 0]
    problem = Problem(made.model, h, made.y + 0.5 * h[:, :, 6])
    mine = Candidate("effect", problem.columns("effect"), (10.0,))
    other = Candidate("other", problem.columns("other"), (10.0,))
    choice = Choice(problem.fitter(), list(range(6)), [mine, other], [mine])
    models = {m.effect: m for m in undecided(choice, (Family(),))}
    assert models["other"].share > 0.05
    assert sum(m.share for m in models.values()) < 1.0
    assert np.all(np.linalg.eigvalsh(left_open(list(models.values()))) > -1e-12)


def test_what_is_plain_to_see_leaves_no_other_one_open():
    """Scores of hundreds, of which a logarithm can still tell which is larger."""
    rng = np.random.default_rng(5)
    made = drawn(rng, [Columns("effect", 1), Columns("other", 1)], np.zeros(8))
    h = made.h.copy()
    h[:, :, 7] = 0.7 * h[:, :, 6] + 0.7 * h[:, :, 7]
    problem = Problem(made.model, h, made.y + 5.0 * h[:, :, 6])
    mine = Candidate("effect", problem.columns("effect"), (10.0,))
    other = Candidate("other", problem.columns("other"), (10.0,))
    choice = Choice(problem.fitter(), list(range(6)), [mine, other], [mine])
    assert max(m.share for m in undecided(choice, (Family(),))) < 1e-9


@pytest.mark.slow
def test_a_curvature_that_is_just_missed_does_not_put_a_scale_far_off():
    """The z scale of this plane was 9.8 sigma off, and called calibrated."""
    secret = Secret(511032, "plane", "single", ("scale_nonlinearity",), "small")
    judge = examine(heard(secret.spec()), 1)
    true = secret.spec().imus[0]
    c = judge.calibration
    off = np.subtract((*c.scale, *c.offset), (*true.scale, *true.offset))
    assert np.all(np.abs(off) < 3.0 * np.array((*c.scale_sigma, *c.offset_sigma)))
    said = judge.diagnosis()
    assert "scale_nonlinearity" in said.note or said.effects
