"""Compiled loops against numpy's way of doing the same."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.filter.noise_step import bounded
from onboard.core.inputs.segments import Segment
from onboard.core.maths.compiling import prefer_compiled
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.maths.interpolation import Hermite
from onboard.core.model.around import around
from onboard.core.model.quadrature import NodeMaker
from onboard.core.physics.effects.accelerometer_hysteresis import PLAYS, _dragged
from tests.core.compiled import both_ways

pytest.importorskip("numba", reason="numba is not installed")
SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(autouse=True)
def _preference_kept():
    yield
    prefer_compiled()


def uneven(rng, n, step=0.02):
    """Times that wander about an even spacing."""
    return np.cumsum(step * rng.uniform(0.5, 1.5, n))


def segment(rng, *, samples=120, rate=2.0, turn=0.3):
    """Samples of a vehicle that turns about every axis; attitudes that disagree with the rate."""
    t = uneven(rng, samples)
    t_attitude = uneven(rng, samples // 4, 0.08)
    R = rotation_from_vector(turn * rng.normal(size=(len(t_attitude), 3)))
    for k in range(1, len(R)):
        R[k] = R[k - 1] @ R[k]
    return Segment(
        t,
        rate * rng.normal(size=(samples, 3)),
        10.0 * rng.normal(size=(samples, 3)),
        t_attitude,
        R,
        rotation_from_vector(rng.normal(size=3)),
        {"signal": (t[::7], rng.normal(size=(len(t[::7]), 4)))},
    )


@given(SEEDS, st.integers(2, 40))
@settings(max_examples=30, deadline=None)
def test_the_interpolant_is_the_same(seed, n):
    rng = np.random.default_rng(seed)
    t, x = uneven(rng, n), rng.normal(size=(n, 4))
    at = rng.uniform(t[0] - 0.1, t[-1] + 0.1, (7, 5))
    one, other = both_ways(lambda: Hermite(t, x)(at))
    scale = 1.0 + np.abs(one).max()
    np.testing.assert_allclose(other, one, atol=1e-11 * scale)


@given(SEEDS, st.sampled_from([0.01, 0.3, 1.7]), st.floats(-0.05, 0.05))
@settings(max_examples=30, deadline=None)
def test_attitude_between_samples_is_the_same(seed, turn, delay):
    """Samples may contradict the gyroscope by up to a turn: every pivot of the quaternion."""
    rng = np.random.default_rng(seed)
    flown = segment(rng, turn=turn)
    at = rng.uniform(flown.t_attitude[0] - 0.1, flown.t_attitude[-1] + 0.1, 50)
    (one, near), (other, near_too) = both_ways(lambda: flown.attitude_at(at, delay))
    # At half a turn the axis of what is missed has no sign: nothing is to be expected there.
    angle = np.arccos(np.clip((np.trace(np.swapaxes(one, 1, 2) @ other, 0, 1, 2) - 1) / 2, -1, 1))
    assert np.array_equal(near, near_too)
    assert np.quantile(angle, 0.9) < 1e-6
    np.testing.assert_allclose(other @ np.swapaxes(other, 1, 2), np.eye(3) + 0 * one, atol=1e-12)


@given(SEEDS, st.sampled_from([None, (0.1, 0.2, -0.1, 0.3)]))
@settings(max_examples=20, deadline=None)
def test_nodes_and_integrals_are_the_same(seed, shares):
    rng = np.random.default_rng(seed)
    flown = segment(rng)
    six = np.array([1.01, 0.99, 1.02, 0.1, -0.2, 0.3])
    start = np.linspace(flown.t[10], flown.t[-20], 9)
    x = rng.normal(size=3)

    def made():
        maker = NodeMaker(flown, np.array([0.01, -0.02, 0.03]), six)
        inside = maker.intervals(start[:-1], start[1:])
        shaped = None if shares is None else np.array(shares)
        near = around(maker, start, 0.2, np.array([0.1, 0.0, -0.2]), shaped)
        force = inside.signals.f_b[..., None] * x
        signals = (inside.signals.w_b, inside.signals.raw_s, inside.signals.slow("signal"))
        seen = (
            near.f_mean,
            near.averaged,
            near.averaged_place,
            near.slope,
            near.shapes,
            near.shape_places,
        )
        of = inside.of_sensors().both
        return (inside.P, of, *inside.integrals(force), *signals, *seen, near.R, near.swing)

    for one, other in zip(*both_ways(made), strict=True):
        np.testing.assert_allclose(other, one, atol=1e-10 * (1.0 + np.abs(one).max()))


@given(SEEDS, st.floats(0.05, 0.9), st.sampled_from([0.0, 0.4]))
@settings(max_examples=15, deadline=None)
def test_what_a_receiver_makes_of_accelerations_is_the_same(seed, window, lag):
    rng = np.random.default_rng(seed)
    flown = segment(rng)
    # Some epochs so near the ends that not all nodes about them are there.
    epoch = np.sort(rng.uniform(flown.t[0] + 0.7, flown.t[-1] - 0.7, 8))
    maker = NodeMaker(flown, np.zeros(3), np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    made = around(maker, epoch, window, None, np.array([0.1, 0.2, 0.0, lag])).spread
    x, before = rng.normal(size=(len(made.R), 3, 5)), rng.normal(size=(8, 9, 7))

    def added():
        stack = before.copy()
        made.add(x, np.array([1, 2, 4, 5, 6]), stack)
        return stack

    one, other = both_ways(added)
    np.testing.assert_allclose(other, one, atol=1e-12 * (1.0 + np.abs(one).max()))
    for stack in (one, other):  # what is no place, and columns that were not named, stay
        np.testing.assert_array_equal(stack[:, 6:], before[:, 6:])
        np.testing.assert_array_equal(stack[..., [0, 3]], before[..., [0, 3]])


@given(SEEDS, st.integers(1, 300))
@settings(max_examples=30, deadline=None)
def test_what_is_dragged_is_the_same(seed, n):
    rng = np.random.default_rng(seed)
    load, start = np.cumsum(rng.normal(size=n)), rng.normal(size=len(PLAYS))
    one, other = both_ways(lambda: _dragged(load, start))
    np.testing.assert_array_equal(other, one)


@given(SEEDS, st.integers(1, 20))
@settings(max_examples=30, deadline=None)
def test_a_maximum_between_bounds_is_the_same(seed, n):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    H, slope = root @ root.T + 0.5 * np.eye(n), rng.normal(size=n)
    one, other = both_ways(lambda: bounded(H, slope, np.full(n, -0.3), np.full(n, 0.2)))
    np.testing.assert_allclose(other, one, atol=1e-9)
