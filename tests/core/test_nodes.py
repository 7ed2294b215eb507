"""Interpolation, quadrature, relative attitude, averaging and even clocks."""

import numpy as np
import pytest

from onboard.core.frames import rotation_from_vector
from onboard.core.interpolation import Hermite
from onboard.core.nodes import NodeMaker, simpson_weights
from onboard.core.smoothing import mean_slope, mean_weights, second_difference
from onboard.core.stretch import Stretch
from onboard.core.tracks import even_times, untruncated

SIX = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def stretch(t, w, raw):
    return Stretch(t, w, raw, t[:2], np.array([np.eye(3)] * 2), np.eye(3))


def test_parabolas_are_interpolated_exactly_between_uneven_samples():
    t = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 60))
    at = np.linspace(t[2], t[-3], 97)
    assert Hermite(t, 3.0 * t**2 - t)(at) == pytest.approx(3.0 * at**2 - at, abs=1e-12)


def test_simpson_integrates_cubics_exactly():
    x = np.linspace(0.0, 1.0, 9)
    assert simpson_weights(8) @ x**3 == pytest.approx(0.25)


def test_a_constant_rate_turns_by_its_angle():
    t = np.arange(0.0, 2.0, 0.02)
    w = np.tile([0.3, -0.5, 0.8], (len(t), 1))
    nodes = NodeMaker(stretch(t, w, np.zeros_like(w)), np.zeros(3), SIX).intervals(
        np.array([0.5]), np.array([0.9])
    )
    assert nodes.P[0, -1] == pytest.approx(rotation_from_vector(0.4 * w[0]), abs=1e-9)


def test_coning_is_followed():
    """A rate that turns: the attitude against steps a thousand times finer."""
    t = np.arange(0.0, 2.0, 0.02)
    rate = lambda u: np.stack(  # noqa: E731 - one line says it
        [np.sin(6 * u), np.cos(6 * u), 0.5 + 0 * u], axis=-1
    )
    nodes = NodeMaker(stretch(t, rate(t), np.zeros((len(t), 3))), np.zeros(3), SIX).intervals(
        np.array([0.5]), np.array([0.7])
    )
    R, step = np.eye(3), 1e-5
    for u in np.arange(0.5, 0.7 - step / 2, step):
        R = R @ rotation_from_vector(rate(np.array(u + step / 2)) * step)
    assert nodes.P[0, -1] == pytest.approx(R, abs=2e-5)


def test_integrals_are_those_of_fine_sums():
    t = np.arange(0.0, 3.0, 0.02)
    w = np.stack([0.4 * np.sin(3 * t), 0.3 * np.cos(2 * t), 0.6 + 0 * t], axis=-1)
    f = np.stack([np.sin(5 * t), np.cos(4 * t), -9.8 + np.sin(2 * t)], axis=-1)
    made = NodeMaker(stretch(t, w, f), np.zeros(3), SIX)
    nodes = made.intervals(np.array([1.0]), np.array([1.2]))
    first, second = nodes.integrals(nodes.signals.f_b[..., None])
    fine = made.intervals(np.linspace(1.0, 1.2, 401)[:-1], np.linspace(1.0, 1.2, 401)[1:])
    R, v, p = np.eye(3), np.zeros(3), np.zeros(3)
    one, two = fine.integrals(fine.signals.f_b[..., None])
    for k in range(400):
        p = p + v * fine.duration[k] + R @ two[k, :, 0]
        v = v + R @ one[k, :, 0]
        R = R @ fine.P[k, -1]
    assert first[0, :, 0] == pytest.approx(v, abs=1e-6)
    assert second[0, :, 0] == pytest.approx(p, abs=1e-6)


@pytest.mark.parametrize("window", [0.2, 0.35, 0.5])
def test_a_mean_over_a_span_is_the_mean(window):
    offset = np.linspace(-0.25, 0.25, 17)
    velocity = lambda s: 3.0 + 2.0 * s + 1.5 * s**2 - 4.0 * s**3 + 2.0 * s**4  # noqa: E731
    acceleration = 2.0 + 3.0 * offset - 12.0 * offset**2 + 8.0 * offset**3
    s = np.linspace(-window / 2, window / 2, 20001)
    mean = np.trapezoid(velocity(s), s) / window - velocity(0.0)
    assert mean_weights(offset, window) @ acceleration == pytest.approx(mean, rel=0.02)


def test_the_slope_of_averaging_is_a_second_derivative():
    offset = np.linspace(-0.25, 0.25, 17)
    # V'' / 24 for V' = 5 s is 5 / 24.
    assert mean_slope(offset, 0.0) @ (5.0 * offset) == pytest.approx(5.0 / 24.0, rel=0.02)
    assert mean_slope(offset, 0.3) @ (5.0 * offset) == pytest.approx(5.0 / 24.0, rel=0.02)
    assert second_difference(offset) @ (3.0 * offset**2) == pytest.approx(6.0)


def test_jittered_stamps_come_back_to_their_grid():
    rng = np.random.default_rng(4)
    true = 12.0 + 0.2 * np.arange(50)
    stamps = true + rng.uniform(-0.01, 0.01, 50)
    assert np.max(np.abs(even_times(stamps, None) - true)) < 4e-3
    missing = np.delete(stamps, [7, 8, 30])
    assert np.max(np.abs(even_times(missing, None) - np.delete(true, [7, 8, 30]))) < 4e-3


def test_even_stamps_stay_as_they_are():
    true = 12.0 + 0.2 * np.arange(50)
    assert np.array_equal(even_times(true, None), true)


@pytest.mark.parametrize("value", [-7.4, -0.3, 0.2, 3.7])
def test_truncation_is_undone_to_the_middle_of_its_interval(value):
    sent = float(np.trunc(value))
    back = untruncated(sent, 1.0)
    assert back == (0.0 if sent == 0.0 else sent + 0.5 * np.sign(value))
    assert abs(back - value) <= (1.0 if sent == 0.0 else 0.5)
