"""Readings in coarse steps: measured from the samples, and what they leave open of the six.

How finely an accelerometer is read, its message declares: but whoever has scaled, shifted or cut
its numbers before declares nothing.  The samples tell: no two values that were ever read are then
nearer to each other than a step, and the same ones are read again and again.  Chance does not do
that: were the steps half as large, a reading would be on a value that was there before as often as
a coin shows its head.

What a reading was before, it does not say.  Rounded, it is off by a uniform error of a twelfth of
the step's square, which vibration makes white: noise, found with all other noise.  Cut off toward
zero, as C divides whole numbers, it is half a step too small in size, wherever the axis has a
sign; cut off downward, as a shift does, it is half a step too low.  Both are unknowns beside the
six.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.limits import MATTERS_OFFSET
from onboard.core.diagnosis.score import least
from onboard.core.inputs.joined import joined, runs
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import AXIS
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Unknown
from onboard.core.physics.effects.accelerometer_resolution import AccelerometerResolution
from onboard.core.physics.finding import Finding, Quantity

COARSE = 2.0 * MATTERS_OFFSET
"""m/s^2; half of a smaller step is no offset that matters [use]."""
SAME_VALUE = 1e-4
"""m/s^2 by which one value of single precision is read as two, up to the widest range
[physics: 2**-23 of 320 m/s^2, twice, and what undoing a scale adds]."""
NEXT = 1.5
"""Of the least gap between two values: those that are less than the next but one apart [bound]."""
FRACTION = 1.0 / math.sqrt(3.0)
"""Prior sigma of the share of half a step that is missing: from none to all of it are equally
likely, of either sign; so are not at all, toward zero and downward [physics]."""


class Conversion(Family):
    """What integer conversion has taken off readings in coarse steps.

    ``toward_zero`` is one unknown for all axes: the same code has converted them.  Downward is
    one for each, for axes may have been turned round since.
    """

    name = "conversion"
    unknowns = (
        Unknown("conversion_toward_zero", "1", 0.0, FRACTION),
        *(Unknown(f"conversion_down_{a}", "1", 0.0, FRACTION) for a in AXIS),
    )

    def __init__(self, steps: Array, zero: Array) -> None:
        """Take steps (3,) and zeros (3,) of what was reported, raw, sensor axes, m/s^2."""
        self.half, self.zero = 0.5 * steps, zero

    @property
    def alike(self) -> Array:
        """What is cut off downward is an offset, and the same code cuts it off in every flight."""
        out: Array = FRACTION * self.half
        return out

    def acceleration(self, nodes: Signals) -> Array:
        """Half a step away from zero, and half a step up, on each axis."""
        read = nodes.raw_s - self.zero
        away = np.where(np.abs(read) > self.half, np.sign(read), 0.0) * self.half
        out = np.empty((*nodes.t.shape, 3, 4))
        out[..., 0] = away @ nodes.R_bs.T
        out[..., 1:] = nodes.R_bs * self.half
        return out


@dataclass(frozen=True, slots=True)
class Coarse:
    """Readings in coarse steps: what is carried beside the six, and what is said."""

    conversion: Conversion
    finding: Finding


def coarse_of(batches: Sequence[Batch], six: SixParameters) -> Coarse | None:
    """What coarse steps the readings of a flight have; None if none that matter.

    Args:
        batches: the flight.
        six: parameters in force, which give back what was reported.
    """
    steps = steps_of(batches)
    if not steps.any():
        return None
    reported = steps * np.array(six.scale)
    finding = Finding(
        name=AccelerometerResolution.effect,
        unknowns={
            a: Quantity(float(step), 0.0, "m/s^2") for a, step in zip(AXIS, reported, strict=True)
        },
        share_of_mismatch=0.0,
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure=AccelerometerResolution.cure,
    )
    return Coarse(Conversion(steps, np.array(six.offset)), finding)


def steps_of(batches: Sequence[Batch]) -> Array:
    """(3,) steps in which the axes are read, raw, m/s^2; 0 where none matters.

    Parts of the flight are asked by themselves, for parameters may change in between; most of
    those that say anything decide.
    """
    parts: list[Array] = []
    for run in runs(batches):
        parts += np.array_split(joined(run)[1], len(run))
    out = np.zeros(3)
    for j in range(3):
        asked = [x for part in parts if (x := _spacing(part[:, j])) is not None]
        coarse = [(step, told) for step, told in asked if step >= COARSE]
        told = sum(told for _, told in coarse)
        if 2 * len(coarse) > len(asked) and 2.0 * math.log(2.0) * told >= least():
            out[j] = np.median([step for step, _ in coarse])
    return out


def _spacing(read: Array) -> tuple[float, int] | None:
    """The spacing of the values of one axis (n,), and how many readings came back to one of them.

    0 where it is fine; None if nothing is to be told from one value.
    """
    values = np.sort(read)
    gaps = np.diff(values)
    gaps = gaps[gaps > SAME_VALUE]
    if not len(gaps):
        return None
    if (least_gap := float(gaps.min())) < COARSE:
        return 0.0, 0
    # A reading that is the one before says nothing new, nor does a value that is read once.
    changes = int(np.count_nonzero(np.abs(np.diff(read)) > SAME_VALUE))
    again = max(changes - len(gaps), 0)
    return float(np.mean(gaps[gaps < NEXT * least_gap])), again
