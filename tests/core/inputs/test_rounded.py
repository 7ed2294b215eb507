"""What is in proportion to a rounded signal keeps its size."""

import numpy as np
import pytest

from onboard.core.inputs.rounded import unrounded

STEP = 0.01


def throttle(n, seed):
    """A throttle that is held, and told in whole steps every fifth of a second, with its times."""
    rng = np.random.default_rng(seed)
    t = 0.2 * np.arange(n) + rng.uniform(-0.02, 0.02, n)
    x = np.zeros(n)
    for i in range(1, n):
        x[i] = 0.8 * x[i - 1] + 0.012 * rng.standard_normal()
    x += 0.4
    return t, x, STEP * np.round(x / STEP)


def size(y, x):
    """Slope of what changes by how x changes: what a filter with a slow error goes by."""
    return float(np.diff(y) @ np.diff(x) / (np.diff(x) @ np.diff(x)))


@pytest.mark.parametrize("seed", range(3))
def test_what_is_in_proportion_is_found_at_its_size(seed):
    t, true, told = throttle(20000, seed)
    rounded = size(true, told)
    assert rounded < 0.96
    assert abs(size(true, unrounded(t, told, STEP)) - 1.0) < 0.25 * (1.0 - rounded)


def test_a_signal_that_is_not_rounded_or_does_not_change_is_left():
    t, true, told = throttle(50, 5)
    assert unrounded(t, true, STEP) is true
    assert unrounded(t[:2], told[:2], STEP) is not None
    still = np.full(50, 0.37)
    assert unrounded(t, still, STEP) is still


def test_what_changes_slowly_comes_nearer_to_itself():
    t = 0.2 * np.arange(400)
    slowly = 0.4 + 0.03 * np.sin(0.3 * t)
    told = STEP * np.round((slowly + np.random.default_rng(2).normal(0.0, 2e-3, 400)) / STEP)
    found = unrounded(t, told, STEP)
    assert np.abs(found - told).max() <= 2.0 / 3.0 * STEP + 1e-12
    assert np.std(found - slowly) < 0.9 * np.std(told - slowly)


def test_samples_at_one_time_are_left():
    t = np.array([0.0, 0.2, 0.2, 0.4])
    told = np.array([0.1, 0.2, 0.3, 0.1])
    assert unrounded(t, told, STEP) is told
