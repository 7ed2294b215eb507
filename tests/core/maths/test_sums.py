"""Sums of whitened rows: what may be added, taken out, moved and stored without a look back."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.maths.sums import BankSums, NormalSums
from onboard.errors import StateError

M = 5


def rows(seed, count):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, M)), rng.normal(size=count)


def summed(h, y):
    sums = BankSums(1, M)
    sums.add(y[None], h[None], np.array([0.1 * len(y)]))
    out = sums.member(0)
    out.G = 0.01 * h.T @ h
    return out


def assert_same(a, b, rtol=1e-11):
    scale = max(1.0, float(np.abs(a.N).max()), a.s)
    for x, y in ((a.N, b.N), (a.b, b.b), (a.G, b.G), (a.s, b.s), (a.log_det, b.log_det)):
        np.testing.assert_allclose(x, y, rtol=rtol, atol=rtol * scale)
    assert a.rows == pytest.approx(b.rows)


@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 40), min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_sums_of_pieces_are_the_sums_of_the_whole(seed, lengths):
    h, y = rows(seed, sum(lengths))
    cuts = np.cumsum(lengths)[:-1]
    pieces = [summed(*p) for p in zip(np.split(h, cuts), np.split(y, cuts), strict=True)]
    whole = summed(h, y)
    forward, backward = NormalSums.zeros(M), NormalSums.zeros(M)
    for piece in pieces:
        forward = forward + piece
    for piece in reversed(pieces):
        backward = piece + backward
    assert_same(forward, whole)
    assert_same(backward, whole)


@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(0, 30))
@settings(max_examples=40, deadline=None)
def test_taking_a_piece_out_leaves_the_other(seed, one, two):
    h, y = rows(seed, one + two)
    rest = summed(h, y) - summed(h[:one], y[:one])
    assert_same(rest, summed(h[one:], y[one:]), rtol=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_shifted_sums_are_those_of_the_shifted_rows(seed):
    h, y = rows(seed, 25)
    theta = np.random.default_rng(seed + 1).normal(size=M)
    assert_same(summed(h, y).shifted(theta), summed(h, y - h @ theta), rtol=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_residual_is_that_of_the_rows(seed):
    h, y = rows(seed, 25)
    theta = np.random.default_rng(seed + 1).normal(size=M)
    assert summed(h, y).residual(theta) == pytest.approx(float(np.sum((y - h @ theta) ** 2)))


def test_subset_is_the_smaller_model():
    h, y = rows(11, 30)
    index = [4, 0, 2]
    small = summed(h, y).subset(index)
    np.testing.assert_allclose(small.N, h[:, index].T @ h[:, index])
    np.testing.assert_allclose(small.b, h[:, index].T @ y)
    np.testing.assert_allclose(small.G, 0.01 * small.N)
    np.testing.assert_allclose(np.diag(small.signal), 0.99 * np.diag(small.N))
    assert (small.s, small.rows) == (pytest.approx(float(y @ y)), 30)


@given(st.integers(0, 2**32 - 1), st.integers(0, 30))
@settings(max_examples=40, deadline=None)
def test_stored_sums_are_the_same_to_the_bit(seed, count):
    sums = summed(*rows(seed, count))
    back = NormalSums.from_bytes(sums.to_bytes())
    for name in ("N", "b", "G"):
        assert np.array_equal(getattr(back, name), getattr(sums, name))
    assert (back.s, back.rows, back.log_det) == (sums.s, sums.rows, sums.log_det)


@given(st.integers(0, 600))
@settings(max_examples=60, deadline=None)
def test_sums_cut_short_are_refused(length):
    data = summed(*rows(1, 9)).to_bytes()
    with pytest.raises(StateError):
        NormalSums.from_bytes(data[: min(length, len(data) - 1)])


@given(st.binary(max_size=200))
@settings(max_examples=100, deadline=None)
def test_anything_else_is_refused(data):
    with pytest.raises(StateError):
        NormalSums.from_bytes(data)


@pytest.mark.parametrize("at", [0, 4, 8])
def test_a_damaged_head_is_refused(at):
    data = bytearray(summed(*rows(1, 9)).to_bytes())
    data[at] ^= 0x41
    with pytest.raises(StateError):
        NormalSums.from_bytes(bytes(data))


@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("place", [7, -1])
def test_numbers_that_are_none_are_refused(number, place):
    data = bytearray(summed(*rows(1, 9)).to_bytes())
    at = 12 + 8 * (place % ((len(data) - 12) // 8))
    data[at : at + 8] = struct.pack("<d", number)
    with pytest.raises(StateError):
        NormalSums.from_bytes(bytes(data))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_shifts_add_up_and_go_through_sums(seed):
    rng = np.random.default_rng(seed)
    one, two = summed(*rows(seed, 12)), summed(*rows(seed ^ 1, 9))
    a, b = rng.normal(size=M), rng.normal(size=M)
    assert_same(one.shifted(a).shifted(b), one.shifted(a + b), rtol=1e-9)
    assert_same((one + two).shifted(a), one.shifted(a) + two.shifted(a), rtol=1e-9)
    assert_same(one.shifted(a).shifted(-a), one, rtol=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
@settings(max_examples=40, deadline=None)
def test_forgetting_weighs_every_innovation_alike(seed, weight):
    h, y = rows(seed, 25)
    root = np.sqrt(weight)
    light = summed(root * h, root * y)
    faded = summed(h, y).scaled(weight)
    np.testing.assert_allclose(faded.N, light.N, atol=1e-12)
    np.testing.assert_allclose(faded.b, light.b, atol=1e-12)
    assert faded.s == pytest.approx(light.s)
    assert faded.rows == pytest.approx(25 * weight)


def test_members_of_a_bank_are_summed_each_for_itself():
    rng = np.random.default_rng(9)
    bank, other = BankSums(3, M), BankSums(3, M)
    alone = [NormalSums.zeros(M) for _ in range(3)]
    for epoch in range(6):
        h, y = rng.normal(size=(3, 4, M)), rng.normal(size=(3, 4))
        log_det = rng.normal(size=3)
        (bank if epoch % 2 else other).add(y, h, log_det)
        for i in range(3):
            N, b = h[i].T @ h[i], h[i].T @ y[i]
            one = NormalSums(N, b, np.zeros((M, M)), float(y[i] @ y[i]), 4, float(log_det[i]))
            alone[i] = alone[i] + one
    bank += other
    for i in range(3):
        assert_same(bank.member(i), alone[i])


def test_the_likelihood_of_a_member_is_that_of_a_gaussian():
    """Unknowns integrated out: a dense normal density of the innovations, prior included."""
    h, y = rows(12, 20)
    prior, sigma = np.full(M, 0.3), np.linspace(0.5, 2.0, M)
    got = []
    for scale in (1.0, 2.0):
        bank = BankSums(1, M)
        bank.add(y[None] / scale, h[None] / scale, np.array([2.0 * 20 * np.log(scale)]))
        got.append(bank.log_likelihoods(prior, sigma)[0])
    dense = []
    for scale in (1.0, 2.0):
        S = scale**2 * np.eye(20) + h @ np.diag(sigma**2) @ h.T
        r = y - h @ prior
        dense.append(-0.5 * (np.linalg.slogdet(S)[1] + r @ np.linalg.solve(S, r)))
    assert got[0] - got[1] == pytest.approx(dense[0] - dense[1], rel=1e-9)
