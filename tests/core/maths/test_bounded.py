"""The likeliest values within ranges, beside every set of ends that could be held."""

import itertools

import numpy as np
import pytest

from onboard.core.maths.bounded import bounded


def best_of_all(x, C, low, high):
    """By trying each number free, at its lower and at its upper end."""
    N, best, found = np.linalg.inv(C), np.inf, None
    for where in itertools.product((None, 0, 1), repeat=len(x)):
        at = [i for i, end in enumerate(where) if end is not None]
        ends = np.array([(low, high)[where[i]][i] for i in at])
        if not np.all(np.isfinite(ends)):
            continue
        z = x + C[:, at] @ np.linalg.solve(C[np.ix_(at, at)], ends - x[at])
        z[at] = ends
        cost = (z - x) @ N @ (z - x)
        if np.all(z >= low - 1e-9) and np.all(z <= high + 1e-9) and cost < best:
            best, found = cost, z
    return found


@pytest.mark.parametrize("seed", range(40))
def test_no_other_values_in_range_are_likelier(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(5, 5))
    C = root @ root.T + 0.05 * np.eye(5)
    x, low = rng.normal(size=5), rng.normal(-0.5, 0.5, 5)
    high = low + rng.uniform(0.0, 1.0, 5)
    low[0], high[1], high[2] = -np.inf, np.inf, low[2]
    assert bounded(x, C, low, high) == pytest.approx(best_of_all(x, C, low, high), abs=1e-8)


def test_what_is_in_range_stays_and_what_is_not_pulls_along_what_it_trades_with():
    C = np.array([[1.0, 0.8], [0.8, 1.0]])
    free = np.array([np.inf, np.inf])
    assert bounded(np.array([2.0, 0.3]), C, -free, free).tolist() == [2.0, 0.3]
    z = bounded(np.array([2.0, 0.3]), C, -free, np.array([1.0, np.inf]))
    assert z == pytest.approx([1.0, 0.3 - 0.8])
