"""The chi-square tail against exact values."""

import math

import pytest

from onboard.core.maths.chi_square import survival


@pytest.mark.parametrize("x", [0.0, 0.3, 4.0, 90.0, 1300.0])
def test_two_degrees_of_freedom_are_an_exponential(x):
    assert survival(x, 2) == pytest.approx(math.exp(-0.5 * x), rel=1e-9)


@pytest.mark.parametrize("x", [0.01, 1.0, 3.841458820694124, 40.0])
def test_one_is_a_normal_deviate_squared(x):
    assert survival(x, 1) == pytest.approx(math.erfc(math.sqrt(0.5 * x)), rel=1e-9)


@pytest.mark.parametrize("x", [0.5, 6.0, 20.0, 200.0])
@pytest.mark.parametrize("dof", [6, 10, 24])
def test_even_numbers_are_sums_of_poissons(x, dof):
    exact = sum((0.5 * x) ** k / math.factorial(k) for k in range(dof // 2)) * math.exp(-0.5 * x)
    assert survival(x, dof) == pytest.approx(exact, rel=1e-8, abs=1e-14)


def test_it_agrees_with_a_library():
    scipy = pytest.importorskip("scipy.stats")
    for dof in (1, 3, 6, 9, 31):
        for x in (0.1, 3.0, 12.0, 60.0, 400.0):
            assert survival(x, dof) == pytest.approx(scipy.chi2.sf(x, dof), rel=1e-8, abs=1e-14)


def test_what_is_past_all_numbers_is_zero_and_nothing_is_certain():
    assert survival(1e6, 6) == 0.0
    assert survival(0.0, 6) == 1.0
