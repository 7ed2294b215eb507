"""Which effects are taken, against all subsets of them, each fitted on the rows themselves."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.candidates import Candidate, accepted, believable, possible, smallest
from onboard.core.diagnosis.effort import MOST_EFFECTS
from onboard.core.diagnosis.hypotheses import choose, confounders_of, reconsider_nuisance
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.score import least, surprise
from onboard.core.estimate.pool import Pool
from onboard.core.physics.effects.bias_step import Witness
from tests.core.diagnosis.problems import (
    SIX,
    WIDTHS,
    Problem,
    candidates,
    drawn,
    families,
    least_squares,
    made,
)

DRAWS = 120


def chosen(problem, names=WIDTHS):
    choice = choose(problem.fitter(), list(range(6)), candidates(problem, names))
    return {c.effect for c in choice.chosen}


def best_subset(problem, names=WIDTHS):
    """Of all subsets in which every effect counts as found beside the others, the best by BIC."""
    at, charge = np.zeros(problem.model.size), np.log(problem.y.size)
    chi2, size = {}, {}
    for k in range(len(names) + 1):
        for subset in itertools.combinations(names, k):
            free = [*range(6), *(i for n in subset for i in problem.columns(n))]
            chi2[frozenset(subset)] = least_squares(problem, free, at)[1]
            size[frozenset(subset)] = len(free)

    def found(one, s):
        return surprise(chi2[s - {one}] - chi2[s], WIDTHS[one]) >= least()

    admissible = [s for s in chi2 if all(found(one, s) for one in s)]
    return set(min(admissible, key=lambda s: chi2[s] + charge * size[s]))


def tail(degrees, x):
    """Probability that chi-square of 1, 2 or 3 degrees of freedom is more than ``x``."""
    match degrees:
        case 1:
            return math.erfc(math.sqrt(x / 2.0))
        case 2:
            return math.exp(-x / 2.0)
        case 3:
            return math.erfc(math.sqrt(x / 2.0)) + math.sqrt(2.0 * x / math.pi) * math.exp(-x / 2.0)
    raise AssertionError(degrees)


def test_these_tails_are_those_of_squares_of_normals():
    squares = np.random.default_rng(0).normal(size=(3, 200_000)) ** 2
    for degrees in (1, 2, 3):
        found = np.mean(squares[:degrees].sum(axis=0) > 6.0)
        assert tail(degrees, 6.0) == pytest.approx(found, rel=0.05)


@pytest.mark.parametrize(
    "present", [(), ("a",), ("b",), ("c", "f"), ("a", "e"), ("b", "d", "f"), ("a", "b", "c", "d")]
)
@pytest.mark.parametrize("seed", range(4))
def test_the_best_of_all_subsets_is_found_and_is_the_truth(present, seed):
    problem = made(np.random.default_rng([seed, len(present)]), *present)
    assert chosen(problem) == best_subset(problem) == set(present)


@pytest.mark.parametrize("seed", range(6))
def test_an_effect_that_resembles_what_acts_does_not_stand_in_for_it(seed):
    rng = np.random.default_rng(seed)
    problem = made(rng, "a", "d", size=1.0)
    h = problem.h.copy()
    # f looks like both at once, and does better than either as long as it is alone.
    a, d, f = (problem.columns(n)[0] for n in "adf")
    at = np.zeros(problem.model.size)
    signs = np.sign(least_squares(problem, range(problem.model.size), at)[0][[a, d]])
    h[..., f] = (h[..., [a, d]] @ signs + rng.normal(size=h.shape[:2])) / 1.7
    mixed = Problem(problem.model, h, problem.y)
    alone = {n: least_squares(mixed, [*range(6), *mixed.columns(n)], at)[1] for n in "adf"}
    assert min(alone, key=alone.get) == "f"
    assert chosen(mixed) == best_subset(mixed) == {"a", "d"}


@pytest.mark.parametrize(("more", "said"), [(0.08, "a"), (1.0, "b")])
@pytest.mark.parametrize("seed", range(4))
def test_what_has_room_for_another_one_is_taken_if_what_it_adds_matters(seed, more, said):
    """b is a and two more; what they explain is no chance, but may be nothing that matters."""
    rng = np.random.default_rng(seed)
    problem = made(rng, "a", size=3.0, rows=1500)
    (a,), (b, added, _) = problem.columns("a"), problem.columns("b")
    h = problem.h.copy()
    h[..., b] = h[..., a]
    wide = Problem(problem.model, h, problem.y + more * h[..., added])
    at = np.zeros(problem.model.size)
    alone = {n: least_squares(wide, [*range(6), *wide.columns(n)], at)[1] for n in "ab"}
    assert surprise(alone["a"] - alone["b"], WIDTHS["b"]) > least()
    both = candidates(wide, "ab")
    offered = [replace(c, room_for=("a",) if c.effect == "b" else ()) for c in both]
    choice = choose(wide.fitter(), list(range(6)), offered)
    assert {c.effect for c in choice.chosen} == {said}


@pytest.mark.parametrize("seed", range(4))
def test_what_others_have_seen_of_a_jump_is_evidence_once(seed):
    """b is what jumped, e another thing that could have: others have seen one jump, not two.

    Neither beside what jumped, nor in the place of what acts, nor of a nuisance, is e taken.
    """
    problem = made(np.random.default_rng(seed), "a", "b", "d")
    seen = Witness(1000.0, 40, 100.0, np.zeros(3), np.ones(3))
    offered = [
        replace(c, jump=True, witness=seen) if c.effect in "be" else c
        for c in candidates(problem, "abe")
    ]
    base = [*range(6), *problem.columns("d")]
    choice = choose(problem.fitter(), base, offered, offered[:1])
    assert {c.effect for c in choice.chosen} == {"a", "b"}
    nuisance = Candidate("d", problem.columns("d"), (5.0,))
    assert not reconsider_nuisance(choice, nuisance, np.zeros(problem.model.size))
    assert {c.effect for c in choice.chosen} == {"a", "b"}
    (a, b) = sorted(choice.chosen, key=lambda c: c.effect)
    assert choice.besides([a]) == offered[1:]
    assert choice.besides([b]) == offered[:1]
    assert choice.confounders(a) == []


@pytest.mark.parametrize(("largest", "said"), [(5.0, "b"), (20.0, "e")])
def test_what_cannot_be_is_no_likelier_than_what_can(largest, said):
    """b is what jumped, e the rarer kind that explains more, if it may be of the size it needs."""
    rng = np.random.default_rng(3)
    problem = made(rng, "b")
    b, e = problem.columns("b"), problem.columns("e")
    h, more = problem.h.copy(), 0.5 * rng.normal(size=problem.y.shape)
    h[..., e] = 0.1 * h[..., b]
    at = np.linalg.lstsq(h.reshape(-1, h.shape[-1])[:, b], problem.y.ravel(), rcond=None)[0]
    h[..., e[0]] += 0.1 * more / at[0]
    wide = Problem(problem.model, h, problem.y + more)
    seen = Witness(0.0, 1, 100.0, np.zeros(3), np.ones(3))  # of which there is one
    offered = [
        replace(c, jump=True, rare=c.effect == "e", plausible=(largest,) * 3, witness=seen)
        for c in candidates(wide, "be")
    ]
    choice = choose(wide.fitter(), list(range(6)), offered)
    assert [c.effect for c in choice.chosen] == [said]


def test_no_more_than_the_limit_is_taken():
    problem = made(np.random.default_rng(1), *WIDTHS, size=1.0)
    assert best_subset(problem) == set(WIDTHS)
    assert len(chosen(problem)) == MOST_EFFECTS


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1.0, 2.0])
def test_of_noise_nothing_is_made(noise):
    """Asked of six effects and seven jumps, each found as seldom as one of all the catalogue."""
    rng = np.random.default_rng(17)
    found = sum(bool(chosen(made(rng, noise=noise, blocks=8, rows=40))) for _ in range(DRAWS))
    # A thousandth of the flights may: of these, more than one are a fault.
    assert found <= 1


def test_a_score_is_the_probability_of_as_much_at_any_place():
    for width in (1, 2, 3):
        for gain in (3.0, 20.0):
            assert math.exp(-0.5 * surprise(gain, width)) == pytest.approx(tail(width, gain))
            expected = 9.0 * tail(width, gain)
            assert math.exp(-0.5 * surprise(gain, width, 9.0)) == pytest.approx(expected)
    # Far out, where no number is small enough for the probability, it goes on.
    assert surprise(20_000.0, 3) - surprise(10_000.0, 3) == pytest.approx(1e4, rel=1e-3)
    assert surprise(-1.0, 2) == 0.0


def test_evidence_of_what_is_not_there_is_chi_square():
    """From this the rate of false alarms follows, however rare they are."""
    rng = np.random.default_rng(23)
    gains = {1: [], 2: [], 3: []}
    for _ in range(DRAWS):
        problem = made(rng, blocks=8, rows=40)
        fitter = problem.fitter()
        before = fitter.fit(range(6), held_out=False)
        for c in candidates(problem):
            after = fitter.fit([*range(6), *c.index], held_out=False)
            gains[len(c.index)].append(fitter.gain(before, after))
    for width, found in gains.items():
        for p in (0.2, 0.05, 0.01):
            x = next(x for x in np.arange(0.0, 20.0, 0.01) if tail(width, x) <= p)
            expected = tail(width, x) * len(found)
            over = int(np.sum(np.array(found) > x))
            assert over == pytest.approx(expected, abs=4.0 * math.sqrt(expected) + 1.0), (width, p)


def test_a_jump_of_the_offsets_competes_and_is_placed():
    rng = np.random.default_rng(5)
    problem = made(rng, "d", blocks=12)
    y = problem.y.copy()
    y[7:] += problem.h[7:][..., 3:6] @ np.array([0.8, -0.5, 0.6])
    choice = choose(
        Problem(problem.model, problem.h, y).fitter(), list(range(6)), candidates(problem)
    )
    (jump,) = (c for c in choice.chosen if c.jump)
    assert {c.effect for c in choice.chosen} == {"d", jump.effect}
    fit = choice.fitter.fit(choice.free)
    sigma = np.sqrt(np.diag(choice.fitter.covariance(fit))[list(jump.index)])
    off = np.abs(fit.theta[list(jump.index)] - [0.8, -0.5, 0.6])
    assert np.all(off < 4.0 * sigma)


# -- what each gate asks for ------------------------------------------------------------------


@pytest.fixture
def clear():
    """One effect that is clearly there: fitter, fits without and with it, the effect."""
    problem = made(np.random.default_rng(2), "a", size=1.0)
    fitter, (c, *_) = problem.fitter(), candidates(problem)
    return fitter, fitter.fit(range(6)), fitter.fit([*range(6), *c.index]), c


def test_a_score_that_chance_reaches_is_not_enough():
    problem = made(np.random.default_rng(2), "a", size=1.0)
    c = candidates(problem)[0]
    for weakened in (1.0, 0.99, 1.01):
        inflation = weakened * gain_of(problem, c) / gain_at(least(), len(c.index))
        fitter = problem.fitter()
        fitter.pool = Pool(inflation)
        before, after = fitter.fit(range(6)), fitter.fit([*range(6), *c.index])
        if weakened != 1.0:
            assert accepted(fitter, before, after, c) == (weakened < 1.0)


def gain_of(problem, c):
    """What an effect gains of unweakened chi-square."""
    fitter = problem.fitter()
    return fitter.gain(fitter.fit(range(6)), fitter.fit([*range(6), *c.index]))


def gain_at(score, width):
    """The gain that has a score."""
    gains = np.linspace(1.0, 100.0, 99_001)
    return float(np.interp(score, [surprise(g, width) for g in gains[::100]], gains[::100]))


def test_a_size_that_is_not_to_be_believed_is_not(clear):
    fitter, before, after, c = clear
    size = abs(after.theta[c.index[0]])
    assert accepted(fitter, before, after, Candidate("a", c.index, (1.01 * size,)))
    assert not accepted(fitter, before, after, Candidate("a", c.index, (0.99 * size,)))


def of_sign(sign, **more):
    """A problem whose effect "a" has a sign, its fits and the candidate."""
    rng = np.random.default_rng(2)
    theta = np.concatenate([SIX, np.zeros(sum(WIDTHS.values()))])
    theta[6] = sign * 1.0
    problem = drawn(rng, families(), theta)
    c = replace(candidates(problem)[0], positive=True, **more)
    fitter = problem.fitter()
    return fitter, fitter.fit(range(6)), fitter.fit([*range(6), *c.index]), c


def test_what_nature_does_not_allow_is_not_believed_and_has_to_be_clearly_more():
    fitter, before, after, c = of_sign(-1.0)
    assert not possible(fitter, after, c)
    assert not believable(fitter, after, c)
    either = replace(c, positive=False)
    assert believable(fitter, after, either)
    better = either.merit(fitter, before, after)
    assert better == pytest.approx(either.common_score(fitter, before, after))
    assert c.merit(fitter, before, after) == better - CLEARLY


def test_the_sign_that_it_may_have_costs_nothing_nor_does_one_that_is_not_sure():
    fitter, before, after, c = of_sign(1.0)
    assert believable(fitter, after, c)
    assert c.merit(fitter, before, after) == c.common_score(fitter, before, after)
    fitter, _, after, c = of_sign(-0.02)
    assert possible(fitter, after, c)


def test_what_has_a_name_with_the_other_sign_is_not_taken_with_it():
    fitter, before, after, c = of_sign(-1.0, mirrored=("b_0",))
    assert not accepted(fitter, before, after, c)
    assert accepted(fitter, before, after, replace(c, mirrored=()))
    fitter, before, after, c = of_sign(1.0, mirrored=("b_0",))
    assert accepted(fitter, before, after, c)


@pytest.mark.parametrize(("below", "taken"), [(-1.0, True), (1.0, False)])
def test_without_what_is_mirrored_that_is_not_less_than_nothing(below, taken):
    """Sure, small, and changing none of the six: what is left out is told by another unknown."""
    rng = np.random.default_rng(12)
    theta = np.concatenate([SIX, np.zeros(sum(WIDTHS.values()))])
    theta[6] = 0.15
    theta[7] = below
    problem = drawn(rng, families(), theta, blocks=10, rows=600)
    fitter, c = problem.fitter(), candidates(problem)[0]
    beside = [*range(6), *problem.columns("b")]
    before, after = fitter.fit(beside), fitter.fit([*beside, *c.index])
    assert c.score(fitter, before, after) > least()
    assert not accepted(fitter, before, after, c)
    mirrored = replace(c, positive=True, mirrored=("b_0",))
    assert accepted(fitter, before, after, mirrored) is taken


def test_what_gains_in_one_part_of_the_flight_alone_does_not_hold():
    """One wild block is fitted by a column that the rest contradicts."""
    rng = np.random.default_rng(6)
    problem = made(rng)
    y = problem.y.copy()
    y[4] += 5.0 * problem.h[4][:, problem.columns("a")[0]]
    wild = Problem(problem.model, problem.h, y)
    fitter, (c, *_) = wild.fitter(), candidates(wild)
    before, after = fitter.fit(range(6)), fitter.fit([*range(6), *c.index])
    # The fit that has not seen that block fits it no better, all others fit theirs worse.
    assert fitter.held_gain(before, after) < 0.0
    assert not accepted(fitter, before, after, c)
    # Nor is it believed for what it explains of the fit: blocks contradict each other about it.
    seen = [fitter.fit(fit.free, held_out=False) for fit in (before, after)]
    assert c.score(fitter, *seen) < least()
    # As noise that is as the sums say it would be no chance; and yet it does not hold.
    fitter.pool = Pool(1.0)
    assert c.score(fitter, *seen) > least()
    assert not accepted(fitter, before, after, c)


def test_what_is_real_and_does_not_matter_is_left_alone():
    """Sure, and held out; but it moves none of the six, and hardly the residual."""
    rng = np.random.default_rng(12)
    problem = made(rng, "a", size=0.15, blocks=10, rows=600)
    fitter, (c, *_) = problem.fitter(), candidates(problem)
    before, after = fitter.fit(range(6)), fitter.fit([*range(6), *c.index])
    assert c.score(fitter, before, after) > least()
    assert fitter.held_rms(after) > 0.97 * fitter.held_rms(before)
    # Regressors that are independent of the six leave these where they are.
    moved = np.abs(after.theta[:6] - before.theta[:6]).max()
    assert moved < 0.005
    assert not accepted(fitter, before, after, c)


def test_an_axis_that_stays_at_nothing_pays_for_chance_alone():
    # Two unknowns more cost the odds of their tails, which grow with what is explained.
    for gain in (20.0, 100.0, 1000.0):
        cost = surprise(gain, 1) - surprise(gain, 3)
        assert cost == pytest.approx(2.0 * math.log(gain), rel=0.1)


def test_twins_confound_each_other_and_what_acts_beside_does_not():
    rng = np.random.default_rng(21)
    problem = made(rng, "a", "f", size=1.0)
    h = problem.h.copy()
    a, d = (problem.columns(n)[0] for n in "ad")
    h[..., d] = h[..., a] + 0.2 * rng.normal(size=h.shape[:2])
    twins = Problem(problem.model, h, problem.y)
    target, *others = candidates(twins)
    # f has as much evidence, but it is not the same evidence.
    fitter = twins.fitter()
    fitter.pool = Pool(1.0)
    (only,) = confounders_of(fitter, range(6), target, others)
    assert only.name == "d"
    at = np.zeros(twins.model.size)
    chi2 = [least_squares(twins, [*range(6), i], at)[1] for i in (a, d)]
    assert only.delta_bic == pytest.approx(chi2[1] - chi2[0], rel=0.01)


# -- what is not found ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("share", "found"), [(0.5, (0.0, 0.1)), (1.0, (0.3, 0.7)), (1.5, (0.9, 1.0))]
)
def test_the_smallest_size_is_found_as_often_as_not(share, found):
    rng = np.random.default_rng(31)
    scores = []
    for _ in range(60):
        problem = made(rng, blocks=8, rows=60)
        c = candidates(problem, ["c"])[0]
        fitter = problem.fitter()
        fit = fitter.fit([*range(6), *c.index], held_out=False)
        size = np.zeros(problem.model.size)
        size[c.index[-1]] = share * smallest(fitter, fit, c)[-1]
        acted = Problem(problem.model, problem.h, problem.y + problem.h @ size).fitter()
        fits = [acted.fit(free, held_out=False) for free in (range(6), fit.free)]
        scores.append(c.score(acted, *fits))
    assert found[0] <= np.mean(np.array(scores) >= least()) <= found[1]
