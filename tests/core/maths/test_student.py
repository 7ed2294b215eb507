"""Student's t against the tables of NIST's handbook and against its own limits."""

import math

import pytest

from onboard.core.maths.student import quantile, regularised_beta, two_sided


@pytest.mark.parametrize(
    ("dof", "probability", "t"),
    [(1, 0.05, 12.706), (2, 0.01, 9.925), (5, 0.05, 2.571), (10, 0.002, 4.144), (30, 0.1, 1.697)],
)
def test_quantiles_are_those_of_the_tables(dof, probability, t):
    assert quantile(probability, dof) == pytest.approx(t, abs=6e-4)


@pytest.mark.parametrize("dof", [1.0, 2.5, 4.0, 17.0, 400.0])
def test_tail_and_quantile_undo_each_other(dof):
    for probability in (0.5, 0.05, 1e-4, 1e-8):
        assert two_sided(quantile(probability, dof), dof) == pytest.approx(probability, rel=1e-7)


def test_closed_forms():
    # One degree is Cauchy's distribution; two have a root.
    for t in (0.1, 1.0, 7.0, 300.0):
        assert two_sided(t, 1) == pytest.approx(1 - 2 / math.pi * math.atan(t), abs=1e-13)
        assert two_sided(t, 2) == pytest.approx(1 - t / math.sqrt(2 + t * t), abs=1e-12)


def test_many_degrees_are_the_normal_distribution():
    assert two_sided(2.0, 1e6) == pytest.approx(math.erfc(2.0 / math.sqrt(2.0)), rel=1e-5)


def test_ends():
    assert two_sided(0.0, 3) == 1.0
    assert two_sided(math.inf, 3) == 0.0
    assert math.isnan(two_sided(math.nan, 3))
    assert regularised_beta(0.3, 2.0, 5.0) + regularised_beta(0.7, 5.0, 2.0) == pytest.approx(1.0)
