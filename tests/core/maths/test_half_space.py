from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from onboard.core.maths.half_space import least_above

FREE = -np.inf


def problem(seed, m=6):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(2 * m, m)) * rng.uniform(0.1, 10.0, m)
    return A.T @ A, rng.normal(size=m) * 10.0


@pytest.mark.parametrize("seed", range(20))
def test_it_is_the_least_of_all_choices_of_what_is_held(seed):
    N, b = problem(seed)
    bound = np.array([0.0, 0.0, 0.3, -0.2, FREE, FREE])

    def cost(x):
        return 0.5 * x @ N @ x - b @ x

    costs = []
    for choice in product([False, True], repeat=4):
        held = np.array([*choice, False, False])
        x = np.where(held, np.where(np.isfinite(bound), bound, 0.0), 0.0)
        x[~held] = np.linalg.solve(N[np.ix_(~held, ~held)], (b - N @ x)[~held])
        if np.all(x >= bound - 1e-12):
            costs.append(cost(x))
    x = least_above(N, b, bound)
    assert np.all(x >= bound)
    assert cost(x) == pytest.approx(min(costs), rel=1e-9)


def test_bounds_that_nothing_meets_change_nothing():
    N, b = problem(3)
    x = np.linalg.solve(N, b)
    np.testing.assert_array_equal(least_above(N, b, np.full(6, FREE)), x)
    np.testing.assert_array_equal(least_above(N, b, x - 0.1), x)
