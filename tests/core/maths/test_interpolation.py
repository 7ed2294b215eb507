"""Between samples: what a straight line loses of a swing, and where nobody knows better."""

import numpy as np
import pytest

from onboard.core.maths.interpolation import curved

RATE_HZ = 5.0


def swing(t, hz):
    return np.sin(2.0 * np.pi * hz * t + 0.3)


def of_a_swing(values, truth):
    """Share of a swing that is found in its values."""
    return float(values @ truth / (truth @ truth))


@pytest.mark.parametrize("hz", [0.2, 0.6, 1.0])
def test_a_swing_within_a_few_samples_keeps_its_size(hz):
    t = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
    at = np.linspace(1.0, 58.0, 4001)
    truth = swing(at, hz)
    kept = of_a_swing(curved(t, swing(t, hz), at), truth)
    line = of_a_swing(np.interp(at, t, swing(t, hz)), truth)
    assert 1.0 - kept < 0.3 * (1.0 - line)


def test_samples_are_met_and_parabolas_exact():
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.15, 0.25, 40))
    np.testing.assert_allclose(curved(t, swing(t, 0.7), t), swing(t, 0.7), atol=1e-12)
    at = rng.uniform(t[1], t[-2], 200)
    np.testing.assert_allclose(curved(t, (t - 3.0) ** 2, at), (at - 3.0) ** 2, atol=1e-9)


def test_ends_are_held_and_gaps_are_straight():
    t = np.concatenate([np.arange(0.0, 5.0, 0.2), np.arange(12.0, 20.0, 0.2)])
    x = swing(t, 0.8)
    before, after = x[t < 5.0][-1], x[t > 5.0][0]
    gap = np.linspace(t[24], t[25], 50)
    np.testing.assert_allclose(curved(t, x, gap), np.linspace(before, after, 50), atol=1e-12)
    np.testing.assert_array_equal(curved(t, x, np.array([-3.0, 30.0])), x[[0, -1]])


@pytest.mark.parametrize("t", [[0.0], [0.0, 1.0], [0.0, 1.0, 1.0, 2.0]])
def test_too_few_samples_or_two_at_one_time_are_lines(t):
    t, at = np.array(t), np.linspace(-0.5, 2.5, 7)
    np.testing.assert_array_equal(curved(t, np.sqrt(t), at), np.interp(at, t, np.sqrt(t)))
