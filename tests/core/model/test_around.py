"""What a receiver that averages sees around epochs, against brute force."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.inputs.limits import AROUND_S
from onboard.core.inputs.segments import Segment
from onboard.core.model.around import around
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.smoothing import (
    RESOLVED_S,
    Gained,
    averaged,
    averaged_place,
    lagged,
    mean,
    paired,
    slope,
    weight_of_two,
)
from tests.core.model.test_quadrature import NOMINAL, attitude, force, maker, rates

EPOCH = np.array([0.4, 1.5, 2.6])
LONGEST = 2.0 * AROUND_S


def gained(a, seconds=2.0, step=0.01):
    """Of a force along x, a function of time, around one second."""
    t = step * np.arange(round(seconds / step) + 1)
    return Gained(0.0, step, np.stack([a(t - 1.0), 0.0 * t, 0.0 * t], axis=-1))


def even(made, t, window):
    """Mean over a span less the velocity, about times ``t``."""
    return made.seen(t, [averaged(window, made.step)])[0]


def at(x):
    """Of the moment of one second, x."""
    return x[0, 0]


NOW = np.array([1.0])


def in_axes_of(epochs, span):
    """Force around each of the epochs in its axes: (K, n, 3), and the times (n,) about them."""
    s = np.linspace(-span / 2, span / 2, 2001)
    turned = np.swapaxes(attitude(epochs)[:, None], -1, -2) @ attitude(epochs[:, None] + s)
    return s, (turned @ force(epochs[:, None] + s)[..., None])[..., 0]


@pytest.mark.parametrize("window", [0.1, 0.31, 0.8])
@pytest.mark.parametrize("recorded", [False, True])
def test_forces_are_averaged_in_the_axes_of_the_epoch(window, recorded):
    made = around(maker(100.0, recorded=recorded), EPOCH, window)
    s, f = in_axes_of(EPOCH, window)
    np.testing.assert_allclose(made.f_mean, np.trapezoid(f, s, axis=1) / window, atol=2e-3)
    v = np.concatenate([np.zeros((3, 1, 3)), np.cumsum(0.5 * (f[:, 1:] + f[:, :-1]), axis=1)], 1)
    v *= s[1] - s[0]
    mean = np.trapezoid(v, s, axis=1) / window - v[:, len(s) // 2]
    np.testing.assert_allclose(made.averaged, mean, atol=1e-4)
    np.testing.assert_allclose(made.now.f_b, force(EPOCH), atol=2e-4)


@pytest.mark.parametrize("frequency", [30.0, 40.0, 45.0])
@pytest.mark.parametrize("window", [0.0, 0.2, 0.45])
def test_vibration_is_averaged_away(frequency, window):
    """Below half the rate of the samples it is resolved, whatever the phase of the epochs."""
    rate, swing = 100.0, 10.0
    t = np.arange(0.0, 20.0, 1.0 / rate) - 1.0
    shaken = np.zeros((len(t), 3))
    shaken[:, 2] = swing * np.sin(2.0 * np.pi * frequency * t + 0.3)
    level = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    nodes = NodeMaker(Segment(t, 0.0 * shaken, shaken, t, level, np.eye(3)), np.zeros(3), NOMINAL)
    made = around(nodes, np.arange(0.0033, 18.0, 0.2), window)
    # A sine's mean is at most its swing over half its phase; its integral over the whole of it.
    most = swing / (np.pi * frequency)
    assert np.abs(made.averaged).max() < most / 2.0 * (1.0 + most / swing)
    if window:
        assert np.abs(made.f_mean).max() < most / window
    assert np.abs(made.slope).max() < most / max(window, RESOLVED_S) ** 2


@pytest.mark.parametrize("window", [0.0, 0.05, 0.1, 0.31, 0.45, 0.8])
@pytest.mark.parametrize("recorded", [False, True])
def test_a_lever_arm_is_seen_as_the_receiver_averages_it(window, recorded):
    """Against the mean of ``R (w x arm)`` over the span, by brute force."""
    arm = np.array([0.5, -0.3, 0.8])
    made = around(maker(100.0, recorded=recorded), EPOCH, window)
    for k, t in enumerate(EPOCH):
        fine = t + np.linspace(-window / 2, window / 2, 2001)
        swing = np.einsum("nij,nj->ni", attitude(fine), np.cross(rates(fine), arm))
        mean = attitude(EPOCH[k : k + 1])[0].T @ swing.mean(axis=0)
        np.testing.assert_allclose(made.swing[k] @ arm, mean, atol=4e-3)


@pytest.mark.parametrize("window", [0.0, 0.05, 0.1, 0.2, 0.346, 0.45, 0.8])
def test_smoothing_is_the_average_of_the_velocity(window):
    for frequency, phase in ((3.0, 0.3), (6.0, 1.1)):
        fine = np.linspace(-window / 2, window / 2, 20001)
        mean = np.mean(-np.cos(frequency * fine + phase) / frequency) if window else 0.0
        now = -np.cos(phase) / frequency if window else 0.0
        made = gained(lambda t, f=frequency, p=phase: np.sin(f * t + p))
        assert at(even(made, NOW, window)) == pytest.approx(mean - now, abs=2e-4)


@pytest.mark.parametrize("window", [0.0, 0.1, 0.346, 0.8])
def test_a_place_is_averaged_as_the_velocity_is(window):
    """Against the mean of ``-sin(w t) / w^2`` over the span, to what Simpson leaves of it."""
    for w, phase in ((3.0, 0.3), (6.0, 1.1)):
        x = -np.sin(w * np.linspace(-window / 2, window / 2, 20001) + phase) / w**2
        made = gained(lambda t, w=w, p=phase: np.sin(w * t + p))
        got = at(made.seen(NOW, [averaged_place(window)])[0])
        assert got == pytest.approx(x.mean() - x[10000], abs=1e-5 + window**4 * w**2 / 2880.0)


def test_a_place_knows_next_to_nothing_of_vibration():
    """That at the epoch, taken for the mean over the span, would move it by centimetres."""
    w, window = 2.0 * np.pi * 30.0, 0.3
    made = gained(lambda t: 10.0 * np.cos(w * t), step=0.005)
    assert (
        abs(at(made.seen(NOW, [averaged_place(window)])[0])) < 10.0 / w**2 < 0.01 * window**2 * 10.0
    )


@pytest.mark.parametrize("window", [1e-9, 1e-6, 1e-3])
def test_the_shortest_spans_go_with_their_square(window):
    got = even(gained(lambda t: 9.8 + 2.0 * t), NOW, window)
    assert at(got) == pytest.approx(window**2 / 24.0 * 2.0, rel=1e-6)


@pytest.mark.parametrize("window", [0.15, 0.3, 0.42])
def test_smoothing_slope_is_its_derivative(window):
    made, step = gained(lambda t: np.sin(4.0 * t + 0.5)), 0.03
    above, below = (even(made, NOW, np.sqrt(window**2 + s * step**2)) for s in (1, -1))
    numeric = at(above - below) / (2 * step**2)
    assert at(made.seen(NOW, [slope(window, LONGEST, made.step)])[0]) == pytest.approx(
        numeric, rel=0.01
    )


def test_smoothing_slope_of_a_short_window_is_the_second_derivative():
    # V = t^2 / 2 + ...: V'' = a' is 1 everywhere, at 1/24 per s^2 of window^2.
    made = gained(lambda t: t + 3.0)
    got = made.seen(NOW, [slope(0.0, LONGEST, made.step)])[0]
    assert at(got) == pytest.approx(1.0 / 24.0, rel=1e-6)


@pytest.mark.parametrize("window", [0.05, 0.2, 0.346, 0.8])
def test_two_moments_and_a_lag_are_what_they_are_called(window):
    """Against an exponential's mean by brute force, with its own delay taken out."""
    tau = window / np.sqrt(12.0)
    u, w = np.linspace(0.0, 40.0 * tau, 400_001), 5.0
    share = np.exp(-u / tau)

    def velocity(t):
        return -np.cos(w * t + 0.7) / w

    made = gained(lambda t: np.sin(w * t + 0.7))
    lag = np.sum(share * velocity(tau - u)) / share.sum() - velocity(0.0)
    began = np.exp(-1.0 / tau)  # of what was before the first node
    assert at(made.seen(NOW, [lagged(window)], window)[0]) == pytest.approx(lag, abs=2e-4 + began)
    pair = 0.5 * (velocity(tau) + velocity(-tau)) - velocity(0.0)
    assert at(made.seen(NOW, [paired(window)])[0]) == pytest.approx(pair, abs=1e-4)


@given(st.floats(0.02, 0.98), st.floats(0.05, 0.4))
def test_what_is_interpolated_between_two_epochs_is_two_moments(share, apart):
    """``share`` of the older one: its delay counts as latency, its spread as the window."""
    force = np.random.default_rng(3).normal(size=201).cumsum()
    made = gained(lambda t: np.interp(t, 0.01 * np.arange(-100, 101), force))
    newest = NOW + share * apart
    seen = (1.0 - share) * made.velocity(newest) + share * made.velocity(newest - apart)
    window = apart * np.sqrt(12.0 * share * (1.0 - share))
    older = weight_of_two(window, apart)
    assert older == pytest.approx(min(share, 1.0 - share), abs=1e-6)
    got = made.seen(NOW, [paired(window, older if share < 0.5 else 1.0 - older)])[0]
    assert at(got) == pytest.approx(at(seen - made.velocity(NOW)), abs=1e-6)


@pytest.mark.parametrize("window", [1e-6, 0.01, 0.13, 0.5])
def test_whatever_its_shape_a_response_that_spreads_alike_bends_a_ramp_alike(window):
    made = gained(lambda t: 3.0 * t - 2.0)
    bent = at(even(made, NOW, window))
    assert bent == pytest.approx(window**2 / 24.0 * 3.0, rel=1e-6)
    began = np.exp(-1.0 * np.sqrt(12.0) / window)
    shapes = *(paired(window, older) for older in (0.5, 0.25, 0.9)), lagged(window)
    for got in made.seen(NOW, shapes, window):
        assert at(got) == pytest.approx(bent, rel=1e-5 + 50.0 * began, abs=1e-13)
    older, newer = (at(x) for x in made.seen(NOW, [paired(window, w) for w in (0.25, 0.75)]))
    assert older - newer == pytest.approx(0.0, abs=1e-13)


def test_two_moments_that_spread_too_little_are_halves_further_apart():
    assert weight_of_two(1.0, 0.2) == pytest.approx(0.5)


def test_without_a_span_there_are_no_shapes():
    made = around(maker(100.0), EPOCH, 0.0)
    assert not made.shapes.any()


@pytest.mark.parametrize(("centre", "width"), [(0.0, 0.3), (0.1, 0.05), (-0.2, 0.013)])
def test_a_mean_is_that_of_straight_lines(centre, width):
    y = np.random.default_rng(1).normal(size=201)
    t = 0.01 * np.arange(201)
    fine = 1.0 + centre + np.linspace(-width / 2, width / 2, 200_001)
    made = Gained(0.0, 0.01, np.stack([y, y, y], axis=-1))
    brute = float(np.mean(np.interp(fine, t, y)))
    got = made.seen(NOW + centre, [mean(width, made.step)])[0]
    assert at(got) == pytest.approx(brute, abs=1e-4)


@pytest.mark.parametrize("window", [0.1, 0.35, 0.66])
def test_an_averaged_velocity_changes_by_its_averaged_acceleration(window):
    """Also where the acceleration is mostly vibration, of which the average knows nothing."""
    noise = 2.0 * np.random.default_rng(2).normal(size=201)
    made = gained(lambda t: np.sin(3.0 * t) + noise)

    def of_velocity(t):
        return at(even(made, np.array([t]), window) + made.velocity(np.array([t])))

    e = 1e-4
    numeric = (of_velocity(1.0 + e) - of_velocity(1.0 - e)) / (2.0 * e)
    assert at(made.seen(NOW, [mean(window, made.step)])[0]) == pytest.approx(numeric, abs=1e-3)
