"""Leaky integrals against a loop over the time axis."""

import numpy as np
import pytest

from onboard.core.maths.leaky import leaky_integral

POLES = {"real": np.array([-0.5, -0.2]), "turning": np.array([-0.3 + 0.2j, -0.3 - 0.2j])}


def looped(t, gained, pole, start):
    z = [np.asarray(start)]
    for h, x in zip(np.diff(t), gained, strict=True):
        z.append(np.exp(pole * h) * z[-1] + np.exp(0.5 * pole * h) * x)
    return np.array(z)


@pytest.mark.parametrize("pole", POLES.values(), ids=list(POLES))
@pytest.mark.parametrize("n", [2, 200, 201, 700])
def test_it_is_the_loop(pole, n):
    rng = np.random.default_rng(n)
    t = 7.0 + np.cumsum(rng.uniform(0.01, 0.3, n))
    gained, start = rng.standard_normal((n - 1, 2)), np.array([1.0, -2.0])
    got = leaky_integral(t, gained, pole, start)
    np.testing.assert_allclose(got, looped(t, gained, pole, start), atol=1e-9)


@pytest.mark.parametrize("pole", POLES.values(), ids=list(POLES))
def test_it_forgets_what_was_before_a_long_gap(pole):
    t = np.array([0.0, 1.0, 36e3, 36e3 + 1.0])
    got = leaky_integral(t, np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 1.0]]), pole, np.ones(2))
    assert np.abs(got[2]).max() < 1e-60
    np.testing.assert_allclose(got[3], np.exp(0.5 * pole), atol=1e-12)
