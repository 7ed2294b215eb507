"""Blocks hold half of what is symmetric: all of it comes back, bit by bit."""

import numpy as np
import pytest

from onboard.core.maths.blocks import Block, merged, total, whole
from onboard.core.maths.sums import BankSums, NormalSums


def sums(m, seed=0):
    """Of some rows, as a pass adds them up."""
    rng = np.random.default_rng(seed)
    bank = BankSums(1, m)
    bank.add(rng.normal(size=(1, 40)), rng.normal(size=(1, 40, m)), np.array([3.0]))
    made = bank.member(0)
    noisy = np.arange(0, m, 3)
    noise = rng.normal(size=(40, len(noisy)))
    made.G[np.ix_(noisy, noisy)] = noise.T @ noise
    return made


def assert_same(a, b):
    assert (a.s, a.rows, a.log_det) == (b.s, b.rows, b.log_det)
    for name in ("N", "b", "G"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


@pytest.mark.parametrize("m", [0, 1, 7, 60])
def test_sums_come_back_as_they_were(m):
    made = sums(m)
    block = Block(1.0, 2.0, made)
    assert (block.start, block.end, block.rows) == (1.0, 2.0, made.rows)
    assert_same(block.sums, made)
    np.testing.assert_array_equal(block.b, made.b)
    theta = np.random.default_rng(1).normal(size=m)
    np.testing.assert_allclose(block.noise_along(theta), made.G @ theta)


def test_a_block_is_as_its_sums_were_when_it_was_made():
    made = sums(5)
    block, was = Block(0.0, 1.0, made), made.scaled(1.0)
    made.N[:] = 0.0
    block.sums.b[:] = 0.0
    assert_same(block.sums, was)


def test_the_total_is_that_of_the_sums_one_after_the_other():
    every = [sums(9, seed) for seed in range(5)]
    added = NormalSums.zeros(9)
    for one in every:
        added += one
    assert_same(total([Block(0.0, 1.0, one) for one in every]), added)


def test_information_of_several_blocks_side_by_side():
    every = [sums(6, seed) for seed in range(4)]
    N = whole([Block(0.0, 1.0, one).half for one in every], 6)
    np.testing.assert_array_equal(N, [one.N for one in every])


def test_neighbours_are_added_up_until_there_are_few():
    blocks = [Block(float(k), k + 1.0, sums(3, k)) for k in range(11)]
    few = merged(blocks, 4)
    assert [(p.start, p.end) for p in few] == [(0.0, 4.0), (4.0, 8.0), (8.0, 11.0)]
    np.testing.assert_allclose(total(few).N, total(blocks).N, rtol=1e-14)


def test_half_of_the_memory_is_enough():
    made = sums(60)
    assert Block(0.0, 1.0, made)._numbers.nbytes < 0.55 * made.N.nbytes
