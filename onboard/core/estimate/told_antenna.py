"""One origin for the place of the antenna, whatever the autopilot is told of it meanwhile.

The antenna is where it is; what is told of it says only what its unknowns count from.  Flight that
was cut when something else was told would count from there: of a place that was entered between two
flights, one unknown for both would have to be the old error and none.  So all flight that is kept
counts from where the autopilot has the antenna now.  In sums that is a shift, and exact: what a
place makes of a velocity is linear in it, and the point about which latency and averaging were
taken stays where it was on the vehicle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onboard.core.estimate.calibration_model import antenna_of
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array, vector3
from onboard.core.maths.blocks import Block
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Model


def batch_from(batch: Batch, lever: Array) -> Batch:
    """The same flight with the antenna counted from ``lever`` (3,), body axes, m."""
    if np.array_equal(batch.segment.lever_arm_b, lever):
        return batch
    return replace(batch, segment=replace(batch.segment, lever_arm_b=lever))


def point_from(point: Linearisation, by: Array) -> Linearisation:
    """The same point, where the antenna counts from a place further by ``by`` (3,), m."""
    return replace(point, antenna=vector3(np.array(point.antenna) - by))


def shift_by(model: Model, by: Array) -> Array:
    """(m,) by how much unknowns are less if the antenna counts from a place ``by`` (3,) further."""
    shift = np.zeros(model.size)
    shift[antenna_of(model)] = by
    return shift


def shifted(blocks: list[Block], by: Array) -> list[Block]:
    """Sums with unknowns that are less by ``by`` (m,)."""
    return [Block(p.start, p.end, p.sums.shifted(by)) for p in blocks] if np.any(by) else blocks
