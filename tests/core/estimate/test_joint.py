"""Accelerometers of one vehicle together: honest where GPS is all there is, sharp in between."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.common_cause import common_changes, in_words
from onboard.core.estimate.joint import Joint, disagreement, joint, without_prior
from onboard.core.estimate.relative import relative_of
from onboard.core.estimate.shared_windows import shared_windows
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import vector3
from tests.core.estimate.two_accelerometers import Motion, batches

PRIOR = np.repeat([0.03, 0.5], 3)
IN_FORCE = SixParameters()
SHARED = np.repeat([0.008, 0.04], 3)
"""Error that GPS and attitude put into every solution of a flight."""
OWN = 0.2
"""Each one's own error, in units of that."""
CLAIMED = SHARED * np.hypot(1.0, OWN)


def vehicle(rng, n=2, seconds=120.0):
    """True six of ``n`` accelerometers, their solutions with a common error, and their pairs."""
    motion = Motion(rng, seconds)
    true = IN_FORCE.as_vector() + np.repeat([0.02, 0.3], 3) * rng.standard_normal((n, 6))
    six = [SixParameters(vector3(x[:3]), vector3(x[3:])) for x in true]
    noise = 0.05 * rng.standard_normal((n, len(motion.t), 3))
    flights = [batches(motion, s, np.zeros(3), e) for s, e in zip(six, noise, strict=True)]
    common = SHARED * rng.standard_normal(6)
    singles = []
    for i, x in enumerate(true):
        found = x + common + OWN * SHARED * rng.standard_normal(6)
        # The prior is centred on what is in force, and solutions are posteriors.
        P = np.diag(1.0 / (CLAIMED**-2.0 + PRIOR**-2.0))
        posterior = P @ (found / CLAIMED**2 + IN_FORCE.as_vector() / PRIOR**2)
        singles.append(without_prior(i + 1, IN_FORCE, PRIOR, posterior, P))
    pairs = [
        relative_of(
            (i + 1, j + 1),
            shared_windows(flights[i], flights[j]),
            np.tile(IN_FORCE.as_linear(), 2),
            np.tile(PRIOR, 2),
        )
        for i in range(n)
        for j in range(i + 1, n)
    ]
    return true, singles, pairs


@pytest.mark.parametrize("n", [2, 3])
def test_sigmas_of_all_together_are_honest_and_differences_ten_times_sharper(n):
    rng = np.random.default_rng(1)
    own, apart, sharper = [], [], []
    for _ in range(60):
        true, singles, pairs = vehicle(rng, n)
        found = joint(singles, pairs)
        sigma = np.sqrt(np.diag(found.covariance)).reshape(n, 6)
        own.append((found.value - true) / sigma)
        D = np.hstack([np.eye(6), -np.eye(6)])
        C = D @ found.covariance[:12, :12] @ D.T
        between = np.sqrt(np.diag(C))
        apart.append((D @ (found.value - true)[:2].ravel()) / between)
        sharper.append(between / (np.sqrt(2.0) * CLAIMED))
        # Together is not much worse than by itself, and not better than common errors allow.
        assert np.all(sigma < 1.15 * CLAIMED)
        assert np.all(sigma > 0.85 * CLAIMED / np.sqrt(1.0 + (CLAIMED / PRIOR) ** 2))
    assert np.all(np.sqrt(np.mean(np.square(own), axis=0)) < 1.3)
    assert np.all(np.sqrt(np.mean(np.square(apart), axis=0)) < 1.35)
    # The z offset leans on a scale at 1 g, which the motion must tell from it.
    assert np.median(sharper) < 0.1
    assert np.all(np.median(sharper, axis=0) < 0.15)


def test_without_pairs_each_keeps_less_than_it_had():
    _, singles, _ = vehicle(np.random.default_rng(2))
    found = joint(singles, [])
    for s in singles:
        _, covariance = found.of(s.imu)
        assert np.all(np.diag(covariance) > np.diag(s.covariance))
        assert np.all(np.diag(covariance) < 2.1 * np.diag(s.covariance))


def test_one_alone_is_its_own_solution():
    _, singles, _ = vehicle(np.random.default_rng(3))
    found = joint(singles[:1], [])
    value, covariance = found.of(1)
    x = singles[0].estimate
    np.testing.assert_allclose(value, [*x[:3], *(-x[3:] / x[:3])], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(covariance) > 0.0, True)


def test_solutions_with_a_common_error_do_not_contradict_the_pair_and_a_wrong_one_does():
    rng = np.random.default_rng(4)
    fine, wrong = [], []
    for _ in range(40):
        true, _, (pair,) = vehicle(rng)
        # The same error in both: what is claimed is shared.
        P = np.diag(CLAIMED**2)
        shift = SHARED * rng.standard_normal(6)
        a, b = (without_prior(i + 1, IN_FORCE, PRIOR, x + shift, P) for i, x in enumerate(true))
        fine.append(disagreement(pair, a, b))
        off = np.zeros(6)
        off[3] = 3.0 * CLAIMED[3]
        b = without_prior(2, IN_FORCE, PRIOR, true[1] + shift + off, P)
        wrong.append(disagreement(pair, a, b))
    assert np.mean(fine) < 4.0
    assert np.median(wrong) > 16.0


def asked(changes, sigma=0.02, between=0.001):
    """A joint posterior in which x offsets change so."""
    n = len(changes)
    value = np.tile(IN_FORCE.as_vector(), (n, 1))
    before = value.copy()
    value[:, 3] += changes
    covariance = np.kron(np.eye(n), np.diag(PRIOR**2))
    x = np.arange(3, 6 * n, 6)
    covariance[np.ix_(x, x)] = sigma**2 + 0.5 * between**2 * np.eye(n)
    return Joint(tuple(range(1, n + 1)), before, value, covariance)


def test_what_all_ask_alike_is_said_with_the_tilt_that_makes_it():
    (change,) = common_changes(asked([-0.110, -0.111, -0.109]), 0.05)
    (said,) = in_words((change,), 3, 2)
    assert said.startswith("all 3 accelerometers ask for the same change of the x offset, -0.11 ")
    assert "tilted by 0.64 degrees" in said
    assert "three sensors" in said
    (upright,) = in_words((change,), 2, 0)
    assert "tilted" not in upright
    assert upright.startswith("both accelerometers")


@pytest.mark.parametrize(
    "changes",
    [
        [0.01, 0.01, 0.01],  # not worth a word
        [-0.11, 0.05, -0.10],  # one asks for something else
        [-0.11],  # alone
    ],
)
def test_what_is_not_common_is_not_said(changes):
    assert common_changes(asked(changes), 0.05) == ()


def test_a_common_change_must_be_known():
    assert common_changes(asked([-0.11, -0.11], sigma=0.05), 0.05) == ()


def test_small_differences_of_a_common_change_are_details():
    """Pairs are known so well that no two sensors are ever quite alike."""
    assert len(common_changes(asked([-0.11, -0.10], between=0.0005), 0.05)) == 1
    assert common_changes(asked([-0.11, -0.06], between=0.0005), 0.05) == ()
