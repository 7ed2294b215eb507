"""Of two effects, which a flight is rather about: by what each explains."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealing import Secret
from benchmarks.explaining import heard
from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.hypotheses import choose, confounders_of
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.undecided import beyond
from onboard.core.physics.effects.bias_step import Witness
from sitl.builtin.effects import GpsFault, ThrottleCoupling
from tests.core.diagnosis.problems import SIX, Columns, Problem, candidates, drawn

BASE = range(6)


def rivals(seed, *, like, size=0.4):
    """A flight about one of six unknowns of "wide", much like one of the two of "slim"."""
    rng = np.random.default_rng(seed)
    theta = np.concatenate([SIX, np.zeros(8)])
    made = drawn(rng, [Columns("wide", 6), Columns("slim", 2)], theta)
    h = made.h.copy()
    h[:, :, 12] = like * h[:, :, 6] + np.sqrt(1.0 - like**2) * h[:, :, 12]
    problem = Problem(made.model, h, made.y + size * h[:, :, 6])
    return problem.fitter(), *candidates(problem, ("wide", "slim"))


def test_one_of_six_and_one_of_two_that_do_alike_are_not_told_apart():
    """Beside five unknowns that are not there, in most of the draws; if not alike, in none."""
    for like, share in ((0.999, (0.9, 1.0)), (0.5, (0.0, 0.05))):
        close = 0
        for seed in range(40):
            fitter, wide, slim = rivals(seed, like=like)
            told = confounders_of(fitter, list(BASE), slim, [wide])
            close += any(abs(c.delta_bic) < CLEARLY for c in told)
        assert share[0] <= close / 40 <= share[1]


def test_what_explains_more_is_taken_though_the_flight_scatters_along_it():
    """Size of the true effect differs from block to block; what is like it explains less."""
    taken = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        theta = np.concatenate([SIX, np.zeros(2)])
        made = drawn(rng, [Columns("true", 1), Columns("like", 1)], theta, blocks=30)
        h, y = made.h.copy(), made.y
        h[:, :, 7] = 0.99 * h[:, :, 6] + np.sqrt(1.0 - 0.99**2) * h[:, :, 7]
        sizes = 3.0 + 0.3 * rng.normal(size=(30, 1))
        problem = Problem(made.model, h, y + sizes * h[:, :, 6])
        choice = choose(problem.fitter(), list(BASE), candidates(problem, ("true", "like")))
        taken.append(choice.chosen[0].effect)
    assert taken == ["true"] * 20


def test_what_others_have_seen_counts():
    fitter, wide, _ = rivals(1, like=0.5)
    three = Candidate("jump", wide.index[:3], wide.plausible[:3], jump=True)
    before = fitter.fit(BASE, held_out=False)
    after = fitter.fit([*BASE, *three.index], held_out=False)
    witness = Witness(80.0, 50, 80.0, after.theta[three.sizes], np.ones(3))
    more = replace(three, witness=witness).common_score(fitter, before, after)
    alone = three.common_score(fitter, before, after)
    # Of three unknowns a tail falls a little more slowly than exp(-x / 2).
    assert more - alone == pytest.approx(80.0 - 2.0 * np.log(50.0), abs=2.0)


def test_what_one_covariance_has_beyond_another():
    rng = np.random.default_rng(7)
    units = np.diag([1e-3, 1.0, 50.0])
    less, more = (units @ a @ a.T @ units for a in rng.normal(size=(2, 3, 5)))
    np.testing.assert_allclose(beyond(less + more, less), more, rtol=1e-9)
    np.testing.assert_allclose(beyond(less, less + more), 0.0, atol=1e-9 * np.max(less))
    found = beyond(more, less)
    for matrix in (found, less + found - more):
        scaled = np.linalg.solve(units, np.linalg.solve(units, matrix).T)
        assert np.linalg.eigvalsh(scaled).min() > -1e-9
    # Of other units it is the same.
    T = np.diag([7.0, 0.1, 3.0])
    np.testing.assert_allclose(beyond(T @ more @ T, T @ less @ T), T @ found @ T, rtol=1e-8)


@pytest.mark.slow
def test_a_throttle_that_shifts_offsets_is_not_told_as_axes_that_are_not_square():
    """With three unknowns fewer it explains more; z, which a hover does not show, is left open."""
    fault = GpsFault(start=105.0, end=129.5, north=3.33, east=2.57)
    drawn_by = Secret(151192, "copter", "pair", ("throttle_coupling", "gps_fault"), "large").spec()
    spec = replace(drawn_by, effects=(ThrottleCoupling(x=1.09, y=1.14, z=-0.45), fault))
    judge = examine(heard(spec), 1)
    said = judge.diagnosis()
    assert [e.name for e in said.effects] == ["throttle_coupling", "gps_fault"]
    true, c = spec.imus[0], judge.calibration
    off = np.subtract((*c.scale, *c.offset), (*true.scale, *true.offset))
    assert np.all(np.abs(off) < 3.0 * np.array((*c.scale_sigma, *c.offset_sigma)))
