"""Residuals of many models from one table of epochs."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.diagnosis.epochs import Epochs, rms
from onboard.core.filter.traces import EpochTrace
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums

SIZE = 4


@pytest.fixture
def flight():
    """Two blocks with the same times, as two recordings of one vehicle have."""
    rng = np.random.default_rng(5)
    blocks, traces = [], []
    for _ in range(2):
        t = np.arange(0.0, 30.0, 0.2)
        blocks.append(Block(t[0], t[-1], NormalSums.zeros(SIZE)))
        for k, at in enumerate(t):
            n = 0 if k % 7 == 0 else 2
            traces.append(
                EpochTrace(
                    t=at,
                    innovation=rng.normal(size=n),
                    columns=rng.normal(size=(n, SIZE)),
                    y=np.zeros(0),
                    h=np.zeros((0, SIZE)),
                    velocities=n,
                    height=False,
                    refused=() if n else ("velocity",),
                    refused_by=np.zeros(0),
                )
            )
    return traces, blocks


def test_the_residual_is_that_of_each_epoch(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks, SIZE)
    theta = np.array([0.3, -0.2, 0.5, 1.0])
    residual = epochs.residual(theta)
    for x, row in zip(traces, residual, strict=True):
        np.testing.assert_allclose(row[: x.velocities], x.innovation - x.columns @ theta)
        assert np.isnan(row[x.velocities :]).all()
    assert np.array_equal(epochs.refused, [not x.velocities for x in traces])


def test_blocks_are_told_apart_by_order_where_times_repeat(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks, SIZE)
    assert np.array_equal(np.bincount(epochs.block), [len(traces) // 2] * 2)


def test_held_out_takes_each_block_from_the_fit_that_has_not_seen_it(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces, blocks, SIZE)
    thetas = [np.ones(SIZE), -np.ones(SIZE)]
    folds = [(np.array([0]), thetas[0]), (np.array([1]), thetas[1])]
    half = len(traces) // 2
    left = np.concatenate([epochs.residual(thetas[0])[:half], epochs.residual(thetas[1])[half:]])
    assert epochs.held_out_rms(folds) == pytest.approx(rms(left))


def test_an_imprint_that_is_all_there_is_leaves_nothing(flight):
    traces, blocks = flight
    epochs = Epochs.of(traces[: len(traces) // 2], blocks[:1], SIZE)
    theta = np.array([0.0, 0.0, 2.0, 0.0])
    clean = Epochs(
        epochs.t,
        np.where(np.isnan(epochs.innovation), np.nan, epochs.columns @ theta),
        epochs.columns,
        epochs.refused,
        epochs.block,
    )
    i = clean.imprint([2], theta[[2]], theta, 0.0)
    assert i.axis in ("earth_north", "earth_east")
    assert rms(i.left) > 0.5
    np.testing.assert_allclose(i.left, i.made)


def test_nothing_at_all_is_no_number_and_no_crash():
    empty = Epochs.of([], [Block(0.0, 1.0, NormalSums.zeros(SIZE))], SIZE)
    assert np.isnan(rms(empty.residual(np.zeros(SIZE))))
    assert np.isnan(empty.held_out_rms([]))
    assert len(empty.imprint([0], np.zeros(1), np.zeros(SIZE), 0.0).t) == 0
