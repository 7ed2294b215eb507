"""What grows is found, and what only wanders is not called growing."""

import numpy as np
import pytest

from benchmarks.soak.rows import slope

HOURS = np.arange(168.0)


def wandering(rng, lasting):
    """A constant with unit variance, of which so much lasts from hour to hour."""
    values = rng.standard_normal(len(HOURS))
    for i in range(1, len(values)):
        values[i] = lasting * values[i - 1] + np.sqrt(1.0 - lasting**2) * values[i]
    return values


@pytest.mark.parametrize("lasting", [0.0, 0.5, 0.8])
def test_what_wanders_does_not_grow(lasting):
    rng = np.random.default_rng(1)
    grown = sum(slope("memory", HOURS, wandering(rng, lasting)).grows for _ in range(400))
    # One in a thousand if the sigma were known; that it is estimated makes it up to one in 80.
    assert grown <= 5


@pytest.mark.parametrize("lasting", [0.0, 0.5, 0.8])
def test_a_leak_is_found(lasting):
    """Of 1.5 times the spread each day: 10 in a week."""
    rng = np.random.default_rng(2)
    leak = 1.5 * HOURS / 24.0
    assert all(slope("memory", HOURS, wandering(rng, lasting) + leak).grows for _ in range(100))


def test_the_slope_is_what_is_there_and_sigma_says_how_far_off():
    rng = np.random.default_rng(3)
    found = [slope("memory", HOURS, wandering(rng, 0.5) + 0.2 * HOURS / 24.0) for _ in range(400)]
    off = [(one.a_day - 0.2) / one.sigma for one in found]
    assert np.mean([one.a_day for one in found]) == pytest.approx(0.2, abs=0.02)
    assert 0.8 < np.std(off) < 1.3


def test_what_stays_the_same_has_no_slope():
    still = slope("tasks", HOURS, np.full(len(HOURS), 8.0))
    assert still.a_day == still.sigma == 0.0
    assert not still.grows
