"""Errors of a filter: both ways of going through it, and what is known of them."""

import numpy as np
import pytest

from onboard.core.maths.compiling import compiled_loops, prefer_compiled
from onboard.core.maths.kalman_errors import kalman_errors

STATES, MOVED, ERRORS = 7, 4, 3


@pytest.fixture(params=[False, True], ids=["numpy", "compiled"])
def compiled(request):
    prefer_compiled(yes=request.param)
    if request.param and compiled_loops() is None:
        pytest.skip("loops are not compiled here")
    yield request.param
    prefer_compiled()


def drawn(rng, n):
    """Steps of a filter that observes states 2, 5 and 0, and where it begins."""
    moves = 0.1 * rng.standard_normal((n, MOVED, STATES))
    pushed = rng.standard_normal((n, MOVED, ERRORS))
    noise = rng.uniform(0.0, 0.1, (n, STATES))
    variance = rng.uniform(0.5, 2.0, (n, 3))
    x, root = rng.standard_normal((STATES, ERRORS)), rng.standard_normal((STATES, STATES))
    return moves, pushed, noise, np.array([2, 5, 0], dtype=np.int64), variance, x, root @ root.T


def test_it_is_a_kalman_filter_that_does_not_know(compiled):
    """Against Joseph's form, written out."""
    moves, pushed, noise, observed, variance, x, P = drawn(np.random.default_rng(1), 20)
    want, wanted = (x.copy(), P.copy()), []
    for k in range(20):
        F = np.eye(STATES)
        F[:MOVED] += moves[k]
        u = np.zeros((STATES, ERRORS))
        u[:MOVED] = pushed[k]
        y, S = F @ want[0] + u, F @ want[1] @ F.T + np.diag(noise[k])
        H = np.eye(STATES)[observed]
        K = S @ H.T @ np.linalg.inv(H @ S @ H.T + np.diag(variance[k]))
        L = np.eye(STATES) - K @ H
        want = L @ y, L @ S @ L.T + K @ np.diag(variance[k]) @ K.T
        wanted.append(want[0][:3])
    got = kalman_errors(moves, pushed, noise, observed, variance, x, P)
    np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(x, want[0], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(P, want[1], rtol=1e-8, atol=1e-9)
    np.testing.assert_array_equal(P, P.T)


def test_some_steps_and_then_the_others_are_all_of_them(compiled):
    whole = drawn(np.random.default_rng(2), 12)
    *steps, x, P = drawn(np.random.default_rng(2), 12)
    want = kalman_errors(*whole)
    parts = [[s if s.ndim == 1 else s[cut] for s in steps] for cut in (slice(5), slice(5, None))]
    got = np.concatenate([kalman_errors(*part, x, P) for part in parts])
    np.testing.assert_allclose(got, want, rtol=1e-12)


def test_errors_add_up(compiled):
    """Twice an error, and the sum of two, are what a linear filter makes of them."""
    *steps, x, P = drawn(np.random.default_rng(3), 9)
    got = kalman_errors(*steps, x.copy(), P.copy())
    mix = np.array([[2.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    steps[1] = steps[1] @ mix
    np.testing.assert_allclose(kalman_errors(*steps, x @ mix, P), got @ mix, atol=1e-10)
