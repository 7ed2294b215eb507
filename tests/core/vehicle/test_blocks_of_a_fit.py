"""Blocks of a fit: their sums, and the steps that they are of."""

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.limits import BLOCK_S, WINDOW_STEPS
from onboard.core.vehicle.windows import windows_of
from tests.core.vehicle.flights import copter_flight


@pytest.mark.parametrize("over", range(1, WINDOW_STEPS))
def test_steps_behind_a_boundary_are_of_the_block_that_counts_them(over):
    """A few steps of the next block, then a gap as long as it: no row begins there."""
    whole = copter_flight(seconds=90.0)
    per_block = round(BLOCK_S / whole.step_s)
    kept = np.ones(len(whole), dtype=bool)
    # One row begins ``over`` steps short of the boundary's end, and reaches over it.
    shift = (per_block + over) % WINDOW_STEPS
    kept[:shift] = False
    end = per_block + over
    kept[end : 2 * per_block + 3] = False
    flight = whole.cut(kept)
    fit = fitted(copter_model(flight, CopterAirframe.of({}), np.full(3, 0.01)))
    windows = windows_of(flight)
    numbers = np.unique(fit.block)
    assert len(numbers) == len(fit.blocks)
    assert np.array_equal(np.repeat(fit.block[windows.first], windows.counts), fit.block)
    axes = len(fit.model.axes)
    for block, number in zip(fit.blocks, numbers, strict=True):
        assert block.rows == axes * np.count_nonzero(fit.block[windows.first] == number)
