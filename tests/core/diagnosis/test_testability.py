"""How much of a slow signal happens between its samples."""

from types import SimpleNamespace

import numpy as np
import pytest

from onboard.core.diagnosis.limits import MOST_UNSEEN
from onboard.core.diagnosis.testability import unseen_share


def batches(values, size=40):
    """Pieces of a signal as a flight has them."""
    pieces = np.split(values, range(size, len(values), size))
    return [
        SimpleNamespace(segment=SimpleNamespace(slow={"throttle": (np.arange(len(p)), p)}))
        for p in pieces
    ]


def missed_by_lines(fine, every):
    """Share of the variance of ``fine`` that lines between every so many samples miss."""
    t = np.arange(len(fine))
    return np.mean((fine - np.interp(t, t[::every], fine[::every])) ** 2) / np.var(fine)


def test_a_wandering_signal_loses_what_lines_between_its_samples_miss():
    rng = np.random.default_rng(1)
    every, keep = 50, 0.9999
    steps = rng.normal(size=400_000)
    wander = np.empty_like(steps)
    wander[0] = 0.0
    for i in range(1, len(steps)):
        wander[i] = keep * wander[i - 1] + steps[i]
    truth = missed_by_lines(wander, every)
    assert truth < MOST_UNSEEN
    assert unseen_share(batches(wander[::every]), "throttle") == pytest.approx(truth, rel=0.3)


def test_a_slow_signal_loses_nothing_and_a_fast_one_no_more_than_the_bound():
    t = np.arange(1000)
    assert unseen_share(batches(np.sin(t / 100.0)), "throttle") < 1e-4
    assert unseen_share(batches(np.sin(2.5 * t)), "throttle") == MOST_UNSEEN


def test_too_few_samples_show_nothing():
    assert unseen_share(batches(np.array([0.2, 0.5]), size=2), "throttle") == MOST_UNSEEN
    assert unseen_share(batches(np.full(100, 0.3)), "throttle") == MOST_UNSEEN
