"""Two accelerometers on one board: what they say of each other, and how sure that is."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.relative import relative_of
from onboard.core.estimate.shared_windows import shared_windows, window_means
from onboard.core.estimate.wandering import STEADY_GAIN, STEADY_OFFSET, inflation
from onboard.core.maths.accelerometer import SixParameters
from tests.core.estimate.two_accelerometers import Motion, batches, wandering

A = SixParameters((1.02, 0.985, 1.01), (0.2, -0.15, 0.2))
B = SixParameters((0.98, 1.015, 0.99), (-0.3, 0.25, -0.2))
NOWHERE = np.zeros(3)
APART = np.array([0.05, -0.02, 0.03])
PRIOR = np.repeat([0.03, 0.5], 3)
BEFORE = np.tile(SixParameters().as_linear(), 2)


def pair(rng, noise=0.05, *, true=APART, configured=APART, seconds=200.0, wander=0.0):
    motion = Motion(rng, seconds)
    n = len(motion.t)
    own = noise * rng.standard_normal((2, n, 3))
    if wander:
        own[0] += wandering(rng, n, wander, 20.0)
    a = batches(motion, A, NOWHERE, own[0])
    b = batches(motion, B, true, own[1], configured)
    return relative_of((1, 2), shared_windows(a, b), BEFORE, np.tile(PRIOR, 2))


def test_means_over_windows_are_exact_for_straight_lines():
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0.0, 5.0, 60))
    edges = np.linspace(t[0], t[-1], 8)
    got = window_means(t, np.stack([2.0 * t - 1.0, np.ones_like(t)], axis=-1), edges)
    np.testing.assert_allclose(got[:, 0], edges[:-1] + edges[1:] - 1.0, atol=1e-12)
    np.testing.assert_allclose(got[:, 1], 1.0)


def test_two_right_calibrations_leave_nothing_of_the_difference():
    found = pair(np.random.default_rng(2), noise=0.0)
    left = found.difference(A.as_linear(), B.as_linear())
    np.testing.assert_allclose(left, 0.0, atol=1e-3)
    wrong = found.difference(SixParameters().as_linear(), SixParameters().as_linear())
    assert np.all(np.abs(wrong) > 0.1)


def test_one_is_found_from_the_other():
    found = pair(np.random.default_rng(3))
    got, covariance = found.other(A.as_linear(), PRIOR)
    sigma = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(got - B.as_linear()) < 4.0 * sigma)
    assert np.all(sigma[:3] < 2e-3)
    assert np.all(sigma[3:] < 2e-2)


def test_what_both_share_stays_at_its_prior():
    found = pair(np.random.default_rng(4), true=NOWHERE, configured=NOWHERE)
    # The force that both would feel in another unit: (scale, beta) of both in proportion.
    shared = np.concatenate([A.as_linear(), B.as_linear()]) * np.tile([1.0, 0, 0, 1.0, 0, 0], 2)
    shared /= np.sqrt(np.sum((shared / np.tile(PRIOR, 2)) ** 2))
    informed = shared @ found.information @ shared
    assert informed < 0.05
    # Noise of the regressors does not make both scales small.
    mean = found.theta[:3] + found.theta[6:9]
    np.testing.assert_allclose(mean, np.add(A.scale, B.scale), atol=0.015)


def test_a_place_that_was_configured_wrongly_is_found():
    found = pair(np.random.default_rng(5), noise=0.02, configured=NOWHERE)
    sigma = np.sqrt(np.diag(found.covariance)[12:])
    assert np.all(sigma < 0.003)
    # a is at the origin, so it is further from b by minus b's place.
    assert np.all(np.abs(found.distance + APART) < 4.0 * sigma + 1e-3)


def test_a_slip_of_the_configured_place_is_not_pulled_to_what_is_configured():
    """A sign that is wrong: 0.24 m, eight times what a place is usually unknown by."""
    slip = np.array([0.0, 0.0, 0.12])
    found = pair(np.random.default_rng(10), noise=0.02, true=-slip, configured=slip)
    assert found.distance[2] == pytest.approx(0.24, abs=0.005)


def test_too_little_shared_flight_is_no_comparison():
    assert pair(np.random.default_rng(6), seconds=15.0) is None


def test_a_bump_is_left_out():
    rng = np.random.default_rng(7)
    motion = Motion(rng)
    noise = 0.05 * rng.standard_normal((2, len(motion.t), 3))
    noise[0, 4000:4030] += 40.0
    a = batches(motion, A, NOWHERE, noise[0])
    b = batches(motion, B, NOWHERE, noise[1])
    found = relative_of((1, 2), shared_windows(a, b), BEFORE, np.tile(PRIOR, 2))
    assert 1 <= found.refused <= 3
    assert np.all(np.abs(found.difference(A.as_linear(), B.as_linear())) < 5e-3)


def test_white_residuals_are_not_inflated_and_wandering_ones_are():
    rng = np.random.default_rng(8)
    t = np.arange(400.0)
    white = [inflation(t, rng.standard_normal(400), STEADY_GAIN) for _ in range(50)]
    assert 1.0 <= np.mean(white) < 2.0
    slow = [inflation(t, np.repeat(rng.standard_normal(20), 20), STEADY_GAIN) for _ in range(50)]
    assert 10.0 < np.median(slow) < 60.0


@pytest.mark.parametrize("wander", [0.0, 0.02])
def test_sigmas_are_honest_over_a_hundred_flights(wander):
    truth, rng = B.as_linear(), np.random.default_rng(9)
    mean, other = [], []
    for _ in range(100):
        found = pair(rng, seconds=140.0, wander=wander)
        left = found.difference(A.as_linear(), truth) - found.own
        mean.append(left / np.sqrt(np.diag(found.own_covariance)))
        got, covariance = found.other(A.as_linear(), PRIOR)
        other.append((got - truth) / np.sqrt(np.diag(covariance)))
    for scaled in (np.array(mean), np.array(other)):
        spread = np.sqrt(np.mean(scaled**2, axis=0))
        assert np.all(spread < 1.4), spread
        # What wanders slowly cannot be told from a gain that is off: wider than need be.
        assert np.all(spread > 0.4), spread


def test_what_warms_is_as_far_off_as_it_says_although_a_short_flight_hardly_shows_it():
    rng, t, left = np.random.default_rng(3), np.arange(20.0), []
    for _ in range(1000):
        keep, share = np.exp(-1.0 / rng.uniform(10.0, 100.0)), rng.uniform(0.1, 0.8)
        slow = [rng.standard_normal()]
        for step in np.sqrt(1.0 - keep**2) * rng.standard_normal(len(t) - 1):
            slow.append(keep * slow[-1] + step)
        offset = np.sqrt(share) * np.array(slow)
        offset += np.sqrt(1.0 - share) * rng.standard_normal(len(t))
        seen = offset - offset.mean()
        variance = inflation(t, seen, STEADY_OFFSET) * np.mean(seen**2) / len(t)
        left.append(offset.mean() ** 2 / variance)
    assert 0.6 < np.mean(left) < 1.4
