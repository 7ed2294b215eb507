"""Residuals of many models from one table of epochs."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.diagnosis.epochs import Epochs, rms
from onboard.core.filter.traces import Traces
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums

SIZE = 4


@pytest.fixture
def flight():
    """Two blocks with the same times, as two recordings of one vehicle have."""
    rng = np.random.default_rng(5)
    blocks, traces = [], Traces(7, SIZE)
    for _ in range(2):
        t = np.arange(0.0, 30.0, 0.2)
        blocks.append(Block(t[0], t[-1], NormalSums.zeros(SIZE)))
        for k, at in enumerate(t):
            n = 0 if k % 7 == 0 else 2
            traces.add(np.array([at]), np.array([n]), rng.normal(size=(n, 1 + SIZE)))
            traces.add_refused(() if n else ("velocity",), np.zeros(0))
    return traces, blocks


def test_the_residual_is_that_of_each_epoch(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks)
    theta = np.array([0.3, -0.2, 0.5, 1.0])
    residual = epochs.residual(theta)
    for x, row in zip(traces, residual, strict=True):
        np.testing.assert_allclose(row[: x.velocities], x.innovation - x.columns @ theta)
        assert np.isnan(row[x.velocities :]).all()
    assert np.array_equal(epochs.refused, [not x.velocities for x in traces])


def test_blocks_are_told_apart_by_order_where_times_repeat(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks)
    assert np.array_equal(np.bincount(epochs.block), [len(traces) // 2] * 2)


def test_held_out_takes_each_block_from_the_fit_that_has_not_seen_it(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks)
    thetas = [np.ones(SIZE), -np.ones(SIZE)]
    folds = [(np.array([0]), thetas[0]), (np.array([1]), thetas[1])]
    half = len(traces) // 2
    left = np.concatenate([epochs.residual(thetas[0])[:half], epochs.residual(thetas[1])[half:]])
    assert epochs.held_out_rms(folds) == pytest.approx(rms(left))


def test_an_imprint_that_is_all_there_is_leaves_nothing(flight):
    traces, blocks = flight
    epochs, half = Epochs.of(traces, blocks), slice(len(traces) // 2)
    theta = np.array([0.0, 0.0, 2.0, 0.0])
    clean = Epochs(
        epochs.t[half],
        np.where(np.isnan(epochs.innovation), np.nan, epochs.columns @ theta)[half],
        epochs.columns[half],
        epochs.refused[half],
        epochs.block[half],
    )
    i = clean.imprint([2], theta[[2]], theta, 0.0)
    assert i.axis in ("earth_north", "earth_east")
    assert rms(i.left) > 0.5
    np.testing.assert_allclose(i.left, i.made)


def test_nothing_at_all_is_no_number_and_no_crash():
    empty = Epochs.of(Traces(0, SIZE), [Block(0.0, 1.0, NormalSums.zeros(SIZE))])
    assert np.isnan(rms(empty.residual(np.zeros(SIZE))))
    assert np.isnan(empty.held_out_rms([]))
    assert len(empty.imprint([0], np.zeros(1), np.zeros(SIZE), 0.0).t) == 0
