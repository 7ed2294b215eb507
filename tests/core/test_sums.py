"""Normal-equation sums: merging, eliminating, shifting, saving."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.sums import NormalSums
from onboard.errors import StateError


def rows(seed, n=40, m=5):
    rng = np.random.default_rng(seed)
    h = rng.normal(size=(n, m))
    return h, h @ rng.normal(size=m) + 0.1 * rng.normal(size=n)


def sums_of(h, y):
    out = NormalSums.zeros(h.shape[1])
    out.add_rows(h, y)
    return out


@given(st.integers(0, 10_000), st.integers(1, 39))
def test_merging_is_concatenating(seed, cut):
    h, y = rows(seed)
    whole, parts = sums_of(h, y), sums_of(h[:cut], y[:cut]) + sums_of(h[cut:], y[cut:])
    assert pytest.approx(whole.N) == parts.N
    assert parts.b == pytest.approx(whole.b)
    assert parts.s == pytest.approx(whole.s)
    assert parts.rows == whole.rows
    back = whole - sums_of(h[:cut], y[:cut])
    assert pytest.approx(sums_of(h[cut:], y[cut:]).N, abs=1e-9) == back.N


@given(st.integers(0, 10_000))
def test_eliminating_gives_the_joint_solution(seed):
    h, y = rows(seed)
    joint = np.linalg.lstsq(h, y, rcond=None)[0]
    S, c = sums_of(h, y).eliminate([0, 3])
    assert np.linalg.solve(S, c) == pytest.approx(joint[[0, 3]])


@given(st.integers(0, 10_000))
def test_shifting_counts_unknowns_from_elsewhere(seed):
    h, y = rows(seed)
    at = np.random.default_rng(seed + 1).normal(size=h.shape[1])
    moved = sums_of(h, y).shifted(at)
    direct = sums_of(h, y - h @ at)
    assert moved.b == pytest.approx(direct.b, abs=1e-9)
    assert moved.s == pytest.approx(direct.s, rel=1e-9, abs=1e-8)


def test_a_residual_is_that_of_the_rows():
    h, y = rows(3)
    theta = np.arange(5.0)
    assert sums_of(h, y).residual(theta) == pytest.approx(np.sum((y - h @ theta) ** 2))
    assert pytest.approx((h.T @ h)[1:3, 1:3]) == sums_of(h, y).subset([1, 2]).N


def test_bytes_and_back():
    sums = sums_of(*rows(1))
    sums.G[0, 0], sums.log_det = 2.0, 7.0
    again = NormalSums.from_bytes(sums.to_bytes())
    assert np.array_equal(again.N, sums.N)
    assert np.array_equal(again.G, sums.G)
    assert (again.s, again.rows, again.log_det) == (sums.s, sums.rows, sums.log_det)


@pytest.mark.parametrize("damage", [b"", b"OBS1", b"nonsense" * 40])
def test_damaged_bytes_are_refused(damage):
    with pytest.raises(StateError):
        NormalSums.from_bytes(damage)
    good = sums_of(*rows(2)).to_bytes()
    with pytest.raises(StateError):
        NormalSums.from_bytes(good[:-8])
    with pytest.raises(StateError):
        NormalSums.from_bytes(good[:-8] + np.array([np.nan]).tobytes())
