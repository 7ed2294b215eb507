"""How much of what is claimed of a receiver's delay its velocities bear out."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.borne_out import doubted, share_borne_out, widened
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.procedure import examine
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.solution import Solution, solve
from onboard.core.inputs.samples import GpsFix
from tests.core.estimate.test_simulated_flights import fed, flown

PRIOR = 0.5
SMOOTH_FIXES = 5


def a_solution(size=5):
    A = np.random.default_rng(3).normal(size=(size, 2 * size))
    C = 1e-4 * np.linalg.inv(A @ A.T)
    return Solution(np.arange(size) * 0.1, C, np.linalg.inv(C), 1.0, False, 1.0, 100.0)


def conditional(C, i):
    """Covariance of the others where unknown ``i`` is held."""
    rest = [j for j in range(len(C)) if j != i]
    return C[np.ix_(rest, rest)] - np.outer(C[rest, i], C[rest, i]) / C[i, i]


@pytest.mark.parametrize("share", [0.9, 0.3, 0.05])
def test_less_of_one_unknown_leaves_what_is_known_beside_it(share):
    found = a_solution()
    made = widened(found, 2, share, PRIOR)
    assert made.covariance[2, 2] == pytest.approx(found.covariance[2, 2] / share**2)
    assert np.allclose(conditional(made.covariance, 2), conditional(found.covariance, 2))
    assert np.linalg.eigvalsh(made.covariance).min() > 0.0
    assert np.array_equal(made.theta, found.theta)
    # Who errs along with it is less known, too.
    assert np.all(np.diag(made.covariance) > np.diag(found.covariance))


def test_what_is_borne_out_stays_and_what_is_not_is_known_as_without_a_flight():
    found = a_solution()
    assert np.allclose(widened(found, 2, 1.0, PRIOR).covariance, found.covariance)
    for share in (0.0, 1e-9):
        wide = widened(found, 2, share, PRIOR).covariance
        assert wide[2, 2] == pytest.approx(PRIOR**2)
        assert np.allclose(conditional(wide, 2), conditional(found.covariance, 2))


def deaf(samples, seed=2):
    """The same flight with velocities that know nothing of it, as indoors, in place."""
    rng = np.random.default_rng(seed)
    count = sum(isinstance(s, GpsFix) for s in samples)
    white = rng.normal(size=(count + SMOOTH_FIXES, 3))
    kernel = np.ones(SMOOTH_FIXES) / SMOOTH_FIXES
    v = np.stack([np.convolve(white[:, j], kernel, mode="valid") for j in range(3)], axis=1)
    rows = iter(v)
    place = next((s.latitude, s.longitude, s.altitude) for s in samples if isinstance(s, GpsFix))
    out = []
    for s in samples:
        if isinstance(s, GpsFix):
            n, e, d = next(rows)
            where = dict(zip(("latitude", "longitude", "altitude"), place, strict=True))
            s = replace(s, v_n=n, v_e=e, v_d=d, **where)  # noqa: PLW2901
        out.append(s)
    return out


def found_in(samples):
    engine = fed(samples, Calibrator()).engine(1)
    t0 = float(engine.batches[0].segment.t[0])
    return Examination(engine, (), t0=t0).with_noise()


@pytest.fixture(scope="module")
def flight():
    return flown("copter", 80.0, seed=6)[0]


@pytest.mark.slow
def test_fixes_that_follow_a_flight_bear_out_what_they_claim(flight):
    made = found_in(flight)
    point, noise, theta = made.point, made.noise, made.found().theta
    assert share_borne_out(made) > 0.9
    wide = doubted(made)
    assert (made.point, made.noise) == (point, noise)
    assert np.array_equal(made.found().theta, theta)
    i = made.model.index["gps_delay"]
    assert wide.covariance[i, i] < 1.2 * made.found().covariance[i, i]


@pytest.mark.slow
def test_fixes_that_know_nothing_of_a_flight_tell_no_delay(flight):
    made = found_in(deaf(flight))
    i = made.model.index["gps_delay"]
    claimed, wide = (np.sqrt(x.covariance[i, i]) for x in (made.found(), doubted(made)))
    assert claimed < 0.15, "regressors are no smaller for it"
    assert share_borne_out(made) < 0.3
    assert wide > 3.0 * claimed


@pytest.mark.slow
def test_a_diagnosis_says_no_more_of_the_delay_than_is_borne_out(flight):
    made = examine(fed(flight, Calibrator()), 1)
    said = made.engine.found()
    claimed = solve(made.engine.all_blocks, made.engine.model)
    i = made.engine.model.index["gps_delay"]
    assert said.covariance[i, i] > claimed.covariance[i, i]
    made.engine.claim(claimed)
    assert np.allclose(doubted(made.engine).covariance, said.covariance)
    made.engine.claim(said)
    late = made.diagnosis().timing["gps_delay_s"]
    assert late.sigma >= np.sqrt(said.covariance[i, i])
