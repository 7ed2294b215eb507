"""The corrected theorem: it always holds, is attained, and is the paper's where that is true."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onboard.core.estimate.certificate import ResidualWindow, certify, combine, uniform_bound

ROUNDING = 1 + 1e-9
positive = st.floats(1e-3, 1e3)


@st.composite
def lipschitz(draw, dimensions=1):
    """Times, values (n, d) of a broken line whose slope is at most K in length; and K."""
    n = draw(st.integers(1, 30))
    K = draw(st.floats(0.01, 100))
    dt = draw(arrays(np.float64, n, elements=st.floats(1e-3, 10)))
    direction = draw(arrays(np.float64, (n, dimensions), elements=st.floats(-1, 1)))
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    slope = K * direction / np.maximum(1, length)
    start = draw(arrays(np.float64, dimensions, elements=st.floats(-20, 20)))
    t = np.concatenate([[0], np.cumsum(dt)])
    return (
        t,
        start + np.concatenate([np.zeros((1, dimensions)), np.cumsum(slope * dt[:, None], axis=0)]),
        K,
    )


@given(lipschitz(), st.floats(1, 3))
def test_the_bound_holds_for_every_lipschitz_function(function, slack):
    t, u, K = function
    window = ResidualWindow.of(t, u)
    assert window.acceleration <= K * ROUNDING
    assert np.max(np.abs(u)) <= window.uniform_bound * ROUNDING + 1e-12
    # Any larger slope is a bound too.
    assert (
        np.max(np.abs(u))
        <= uniform_bound(math.sqrt(window.l2_squared), window.acceleration * slack, window.duration)
        * ROUNDING
        + 1e-12
    )


@given(lipschitz(dimensions=3))
def test_the_bound_holds_for_the_length_of_vectors(function):
    t, u, K = function
    window = ResidualWindow.of(t, u, acceleration=K)
    assert window.observed_max == pytest.approx(np.max(np.linalg.norm(u, axis=1)))
    assert window.observed_max <= window.uniform_bound * ROUNDING + 1e-12


@given(positive, positive, positive)
def test_the_triangle_attains_the_bound(peak, K, T):
    """Apex at the start, down at slope K, then zero: cut off by the end where it does not fit."""
    foot = peak / K
    assume(foot > 1e-3 * T)
    if foot >= T:
        window = ResidualWindow.of([0, T], [peak, peak - K * T])
    else:
        assume(T - foot > 1e-9 * T)
        window = ResidualWindow.of([0, foot, T], [peak, 0, 0])
    assert uniform_bound(math.sqrt(window.l2_squared), K, T) == pytest.approx(peak, rel=1e-6)


@given(positive, positive, positive)
def test_the_bound_solves_the_inequality_with_equality(l2, K, T):
    m = uniform_bound(l2, K, T)
    left = m**3 - max(0.0, m - K * T) ** 3
    assume(m < 1e4 * K * T)  # beyond, the difference of the cubes has no digits left
    assert left == pytest.approx(3 * K * l2**2, rel=1e-6)


@given(positive, positive, positive)
def test_it_is_the_papers_where_the_triangle_fits_and_larger_elsewhere(l2, K, T):
    m = uniform_bound(l2, K, T)
    paper = (3 * K * l2**2) ** (1 / 3)
    if paper <= K * T:
        assert m == pytest.approx(paper)
    else:
        assert m > paper


def test_the_papers_inequality_fails_for_a_constant_and_this_one_does_not():
    l2, T = 3 * math.sqrt(10), 10.0  # u = 3 on ten seconds
    for K in (0.0, 1e-300, 1e-9, 1e-3):
        assert (3 * K * l2**2) ** (1 / 3) < 3
        assert 3 <= uniform_bound(l2, K, T) <= 3 + K * T
    assert uniform_bound(l2, 0.0, T) == pytest.approx(3)


@given(positive, positive, positive, st.floats(1, 10))
def test_it_grows_with_norm_and_slope_and_falls_with_the_window(l2, K, T, more):
    m = uniform_bound(l2, K, T)
    assert uniform_bound(more * l2, K, T) >= m / ROUNDING
    assert uniform_bound(l2, more * K, T) >= m / ROUNDING
    assert uniform_bound(l2, K, more * T) <= m * ROUNDING


def test_limits():
    assert uniform_bound(0.0, 5.0, 10.0) == 0
    assert uniform_bound(0.0, math.inf, 10.0) == 0
    assert uniform_bound(0.1, math.inf, 10.0) == math.inf
    assert uniform_bound(0.1, 1.0, 0.0) == math.inf  # a point bounds nothing
    assert uniform_bound(0.1, 1.0, math.inf) == pytest.approx(0.03 ** (1 / 3))
    assert uniform_bound(0.1, 0.0, math.inf) == 0
    assert uniform_bound(1e-6, 1.0, 1e-12) == pytest.approx(1.0, rel=1e-6)  # T to 0: constant


@pytest.mark.parametrize(
    "bad", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (math.nan, 1, 1), (1, math.nan, 1)]
)
def test_negative_or_undefined_arguments_are_refused(bad):
    with pytest.raises(ValueError, match="must not be negative"):
        uniform_bound(*bad)


@given(lipschitz(dimensions=2))
def test_norm_of_the_broken_line_against_fine_quadrature(function):
    t, u, _ = function
    fine = np.linspace(t[0], t[-1], 20_001)
    values = np.stack([np.interp(fine, t, u[:, k]) for k in range(2)])
    by_sum = np.trapezoid(np.sum(values**2, axis=0), fine)
    assert ResidualWindow.of(t, u).l2_squared == pytest.approx(by_sum, rel=1e-2, abs=1e-6)


def test_a_known_slope_counts_only_if_the_data_do_not_refute_it():
    t, u = [0.0, 1.0, 2.0], [0.0, 2.0, 0.0]
    assert ResidualWindow.of(t, u, acceleration=5.0).acceleration == 5.0
    assert ResidualWindow.of(t, u, acceleration=1.0).acceleration == 2.0


@pytest.mark.slow
@given(lipschitz(dimensions=3), lipschitz(dimensions=3))
def test_the_combined_certificate_holds_on_both_sides_of_a_gap(first, second):
    t = np.concatenate([first[0], first[0][-1] + 100.0 + second[0]])
    u = np.concatenate([first[1], second[1]])
    certificate = certify(t, u, gap=50.0)
    parts = [ResidualWindow.of(*first[:2]), ResidualWindow.of(*second[:2])]
    assert certificate.window_s == pytest.approx(sum(p.duration for p in parts))
    assert certificate.residual_l2**2 == pytest.approx(sum(p.l2_squared for p in parts))
    assert certificate.observed_max == pytest.approx(max(p.observed_max for p in parts))
    assert certificate.observed_max <= certificate.uniform_bound * ROUNDING + 1e-12
    # Sharper, or as sharp, as one window of the shorter length with everything in its norm.
    crude = uniform_bound(
        certificate.residual_l2, certificate.acceleration_bound, min(p.duration for p in parts)
    )
    assert certificate.uniform_bound <= crude * ROUNDING + 1e-12


def test_nothing_to_certify():
    assert combine([]) is None
    assert certify([], np.empty((0, 3)), gap=1.0) is None
    assert certify([0.0, 5.0], np.zeros((2, 3)), gap=1.0) is None
    with pytest.raises(ValueError, match="two epochs"):
        ResidualWindow.of([1.0], [[0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="increasing"):
        certify([1.0, 1.0], np.zeros((2, 3)), gap=1.0)
