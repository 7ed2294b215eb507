"""Quadrature: interpolation, attitude from rates, integrals, averages, even epochs, truncation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.inputs.even_times import even_times
from onboard.core.inputs.segments import Segment
from onboard.core.inputs.tracks import untruncated
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.maths.interpolation import Hermite
from onboard.core.model.quadrature import (
    NodeMaker,
    gregory_weights,
    rotation_increments,
    turns_in_a_row,
)

NOMINAL = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
YAW_RATE = 0.8


def attitude(t):
    """``Rz(psi) Rx(phi)``, which cones, in closed form."""
    phi, psi = 0.6 * np.sin(1.7 * t), YAW_RATE * t
    zero = np.zeros_like(t)
    return rotation_from_vector(np.stack([zero, zero, psi], axis=-1)) @ rotation_from_vector(
        np.stack([phi, zero, zero], axis=-1)
    )


def rates(t):
    """Its body rates."""
    phi = 0.6 * np.sin(1.7 * t)
    return np.stack(
        [0.6 * 1.7 * np.cos(1.7 * t), YAW_RATE * np.sin(phi), YAW_RATE * np.cos(phi)], axis=-1
    )


def force(t):
    return np.stack([np.sin(2.1 * t), 1.5 * np.cos(1.2 * t), -9.8 + 2.0 * np.sin(0.9 * t)], axis=-1)


def jittered(rate, seconds=6.0):
    """Sample times of a stream that is sent by a busy scheduler."""
    n = int(seconds * rate)
    t = (np.arange(n) + np.random.default_rng(2).uniform(-0.2, 0.2, n)) / rate
    return t - 1.0


def maker(rate=50.0, *, recorded=False):
    t = jittered(rate)
    segment = Segment(t, rates(t), force(t), t, attitude(t), np.eye(3))
    return NodeMaker(segment, np.zeros(3), NOMINAL, recorded_attitude=recorded)


@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3), st.integers(0, 1000))
@settings(max_examples=50, deadline=None)
def test_parabolas_are_interpolated_exactly(coefficients, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.01, 0.2, 30))
    at = rng.uniform(t[0], t[-1], 100)
    x = np.polyval(coefficients, t)
    np.testing.assert_allclose(Hermite(t, x)(at), np.polyval(coefficients, at), atol=1e-9)


def test_interpolation_passes_through_the_samples():
    t = jittered(50.0)
    x = np.random.default_rng(1).normal(size=(len(t), 3))
    np.testing.assert_allclose(Hermite(t, x)(t), x, atol=1e-12)


def test_interpolation_of_a_manoeuvre_loses_less_than_a_thousandth():
    t = np.arange(0.0, 5.0, 0.04)
    at = np.linspace(1.0, 4.0, 999)
    true = np.sin(2 * np.pi * at)
    error = Hermite(t, np.sin(2 * np.pi * t))(at) - true
    straight = np.interp(at, t, np.sin(2 * np.pi * t)) - true
    assert np.abs(error).max() < 1e-3 < np.abs(straight).max()


def test_a_constant_turn_is_exact():
    w = np.array([0.7, -1.1, 0.4])
    increments = rotation_increments(np.tile(w, (1, 9, 1)), np.array([0.05]))
    np.testing.assert_allclose(increments[0], np.tile(0.05 * w, (4, 1)), atol=1e-15)


def test_a_constant_rate_turns_an_interval_by_its_angle():
    t = np.arange(0.0, 2.0, 0.02)
    w = np.tile([0.3, -0.5, 0.8], (len(t), 1))
    still = np.array([np.eye(3)] * 2)  # attitude is known at two moments only
    segment = Segment(t, w, np.zeros_like(w), t[:2], still, np.eye(3))
    made = NodeMaker(segment, np.zeros(3), NOMINAL).intervals(np.array([0.5]), np.array([0.9]))
    np.testing.assert_allclose(made.P[0, -1], rotation_from_vector(0.4 * w[0]), atol=1e-9)


def test_increments_are_of_fourth_order():
    errors = []
    for h in (0.2, 0.1):
        t = np.linspace(0.3, 0.3 + h, 3)
        turn = rotation_from_vector(rotation_increments(rates(t)[None], np.array([h])))[0, 0]
        true = attitude(t[:1])[0].T @ attitude(t[-1:])[0]
        errors.append(np.abs(turn - true).max())
    assert errors[1] < errors[0] / 20.0  # local error of fifth order: 32


@pytest.mark.parametrize("recorded", [False, True])
def test_attitude_inside_an_interval_is_that_of_the_closed_form(recorded):
    start = np.array([0.11, 1.03, 2.4])
    made = maker(100.0, recorded=recorded).intervals(start, start + 0.2)
    true = np.swapaxes(attitude(start)[:, None], -1, -2) @ attitude(made.signals.t)
    tolerance = 3e-4 if recorded else 1e-5  # recorded attitude is interpolated along arcs
    assert np.abs(made.P - true).max() < tolerance


def test_a_long_row_of_turns_is_what_its_steps_make():
    h = 0.01
    t = 0.5 * h * np.arange(2 * 500 + 1)
    row = turns_in_a_row(rates(t)[None], np.full(1, h))[0]
    true = attitude(t[:1])[0].T @ attitude(t[::2])
    assert row.shape == true.shape
    assert np.abs(row - true).max() < 1e-6


@pytest.mark.parametrize("rate", [50.0, 200.0])
def test_integrals_are_those_of_a_fine_integration(rate):
    start = np.array([0.0, 0.7, 1.9, 3.1])
    T = 0.2
    made = maker(rate).intervals(start, start + T)
    once, twice = made.integrals(made.signals.f_b[..., None])
    for k, begin in enumerate(start):
        t = np.linspace(begin, begin + T, 4001)
        a = np.einsum("ij,njk,nk->ni", attitude(t[:1])[0].T, attitude(t), force(t))
        v = np.trapezoid(a, t, axis=0)
        x = np.trapezoid((begin + T - t)[:, None] * a, t, axis=0)
        np.testing.assert_allclose(once[k, :, 0], v, atol=2e-5)
        np.testing.assert_allclose(twice[k, :, 0], x, atol=4e-6)


@pytest.mark.parametrize("count", [8, 9, 30, 41])
def test_what_alternates_from_node_to_node_is_not_taken_for_a_slow_force(count):
    alternating = (-1.0) ** np.arange(count + 1)
    ends = 2.0 * 2.0 / count
    assert abs(gregory_weights(count) @ alternating) < ends


@pytest.mark.parametrize("frequency", [30.0, 40.0, 45.0])
def test_vibration_below_half_the_rate_of_the_samples_is_no_slow_force(frequency):
    """As in the sum of the samples; of 45 Hz Simpson would see a tenth."""
    rate, seconds, swing = 100.0, 0.2, 10.0
    t = np.arange(0.0, 30.0, 1.0 / rate) - 1.0
    shaken = np.zeros((len(t), 3))
    shaken[:, 2] = swing * np.sin(2.0 * np.pi * frequency * t + 0.3)
    level = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    start = np.arange(0.0033, 28.0, seconds)
    nodes = NodeMaker(Segment(t, 0.0 * shaken, shaken, t, level, np.eye(3)), np.zeros(3), NOMINAL)
    made = nodes.intervals(start, start + seconds)
    gained = made.integrals(made.signals.f_b[..., None])[0][:, 2, 0]
    # Whole swings; at either end a third of a node's weight is another than that of the middle.
    assert np.abs(gained).max() < 2.0 / 3.0 * swing / (1.5 * rate)


def test_bias_is_subtracted_and_the_six_applied():
    t = jittered(100.0)
    six = np.array([1.1, 0.9, 1.2, 0.3, -0.2, 0.1])
    R_bs = rotation_from_vector(np.array([0.0, 0.0, np.pi / 2]))
    bias = np.array([0.01, 0.02, -0.03])
    segment = Segment(t, rates(t), force(t), t, attitude(t), R_bs)
    got = NodeMaker(segment, bias, six).signals(t[5:9])
    np.testing.assert_allclose(got.w_b, rates(t[5:9]) - bias, atol=1e-12)
    np.testing.assert_allclose(got.f_b, (force(t[5:9]) * six[:3] + six[3:]) @ R_bs.T, atol=1e-12)


@pytest.mark.parametrize("count", [4, 8, 10])
def test_gregory_is_exact_for_cubics(count):
    x = np.linspace(0.0, 1.0, count + 1)
    for power in range(4):
        assert gregory_weights(count) @ x**power == pytest.approx(1.0 / (power + 1))


@pytest.mark.parametrize("period", [0.1, 0.2, 0.125])
@pytest.mark.parametrize("seed", range(4))
def test_a_jittered_grid_is_recovered(period, seed):
    rng = np.random.default_rng(seed)
    numbers = np.flatnonzero(rng.uniform(size=200) > 0.05)  # some fixes are lost
    grid = 50.0 + period * numbers
    stamps = grid + rng.uniform(0.0, 0.02, len(grid))
    even = even_times(stamps, None)
    error = even - grid
    assert np.ptp(error) < 4e-3 < np.ptp(stamps - grid)
    assert 0.005 < error.mean() < 0.015  # the mean transport stays: it is part of the delay
    assert np.all(np.diff(even) > 0)


def test_receiver_time_carries_the_grid_through_gaps():
    rng = np.random.default_rng(3)
    receiver = 1e5 + np.sort(rng.choice(2000, 150, replace=False)) * 0.0731
    boot = 40.0 + (receiver - receiver[0]) * (1.0 + 5e-5)
    stamps = boot + rng.uniform(0.0, 0.02, len(boot))
    error = even_times(stamps, receiver) - boot
    assert np.ptp(error) < 5e-3


def test_a_receiver_time_that_is_rounded_does_not_move_epochs_that_are_even():
    boot = 10.0 + 0.5 * np.arange(40)
    rounded = np.floor((boot + 0.013) / 0.2) * 0.2  # half a second apart, by 0.4 and 0.6 in turn
    assert np.array_equal(even_times(boot, rounded), boot)
    stamps = boot + np.random.default_rng(1).uniform(0.0, 0.02, len(boot))
    assert np.ptp(even_times(stamps, rounded) - boot) < 4e-3


def test_epochs_that_a_receiver_does_not_measure_evenly_are_where_it_says():
    rng = np.random.default_rng(5)
    receiver = 0.2 * np.arange(60) + rng.choice([0.0, 0.07], 60)
    stamps = 33.0 + receiver + rng.uniform(0.0, 0.02, 60)
    assert np.std(even_times(stamps, receiver) - receiver) < 2e-3


def test_even_stamps_stay_as_they_are():
    stamps = 10.0 + 0.2 * np.arange(50)
    assert np.array_equal(even_times(stamps, None), stamps)


def test_a_clock_that_was_set_is_not_forced_onto_a_grid():
    stamps = 10.0 + 0.2 * np.arange(60)
    stamps[30:] += 0.09
    stamps[45:] += 0.08
    stamps[50:] += 5.07
    receiver = 0.2 * np.arange(60.0)
    even = even_times(stamps, receiver)
    assert np.array_equal(even, stamps)


@given(st.floats(-1e3, 1e3), st.sampled_from([1e-3, 9.80665e-3]))
def test_truncation_is_undone_to_half_a_step(x, step):
    sent = np.trunc(x / step) * step
    back, *others = untruncated(np.array([sent, -sent, 0.0]), step)
    assert others == [-back, 0.0]
    if abs(x) >= step:
        assert abs(back - x) <= 0.5 * step * (1 + 1e-6)
    else:
        assert back == 0.0
    np.testing.assert_array_equal(untruncated(np.array([x]), 0.0), [x])


def test_truncation_leaves_no_mean_error():
    rng = np.random.default_rng(0)
    for mean in (-9.8, 0.4):
        x = mean + 0.1 * rng.normal(size=20000)
        sent = np.trunc(x / 9.80665e-3) * 9.80665e-3
        back = untruncated(sent, 9.80665e-3)
        assert abs(np.mean(back - x)) < 1e-4
        assert abs(np.mean(sent - x)) > 4e-3
