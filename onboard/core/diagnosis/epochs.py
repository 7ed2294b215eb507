"""What the epochs of a flight left, as one table: residuals of many models at little cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.traces import Traces, residual
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.physics.finding import Imprint

SHOWN_S = 40.0
"""An effect is shown on as much of a flight: more would hide how well it follows the data."""
EARTH = ("earth_north", "earth_east", "earth_down")


@dataclass(frozen=True, slots=True)
class Epochs:
    """Velocity innovations (n, 3) NED, m/s, and their columns (n, 3, m); NaN where not used.

    ``t`` (n,) is on the recording's clock, ``block`` (n,) the block that each is of.
    """

    t: Array
    innovation: Array
    columns: NDArray[np.floating]
    refused: NDArray[np.bool_]
    block: NDArray[np.intp]

    @classmethod
    def of(cls, traces: Traces, blocks: Sequence[Block]) -> Epochs:
        """Share the numbers of traces that are in the order of the flight."""
        block, at, last = np.zeros(len(traces), dtype=np.intp), 0, -np.inf
        for k, t in enumerate(traces.t.tolist()):
            # Several recordings may have the same times: the order decides.
            later = range(at + (t < last), len(blocks))
            at = next((i for i in later if _inside(blocks[i], t)), at)
            block[k], last = at, t
        refused = np.zeros(len(traces), dtype=bool)
        refused[[i for i, names in traces.refused.items() if "velocity" in names]] = True
        return cls(traces.t, traces.innovation, traces.columns, refused, block)

    def residual(self, theta: Array) -> Array:
        """(n, 3) what unknowns (m,) leave, m/s."""
        return residual(self.innovation, self.columns, theta)

    def held_out_rms(self, folds: Sequence[tuple[NDArray[np.intp], Array]]) -> float:
        """Velocity residual, m/s, of blocks with the unknowns that the others gave.

        Args:
            folds: blocks, and the unknowns (m,) of a fit that has not seen them.
        """
        left = []
        for members, theta in folds:
            mine = np.isin(self.block, members)
            left.append(residual(self.innovation[mine], self.columns[mine], theta))
        return rms(np.concatenate(left)) if left else float("nan")

    def imprint(self, index: Sequence[int], change: Array, theta: Array, t0: float) -> Imprint:
        """What some columns make of the velocity, where they make most of it.

        Args:
            index: the columns.
            change: (k,) their unknowns, from absent to found.
            theta: (m,) all unknowns as found.
            t0: first sample, s.
        """
        made = np.where(np.isnan(self.innovation), np.nan, self.columns[..., index] @ change)
        left = self.residual(theta) + made
        size = np.abs(np.nan_to_num(made))
        # A few fixes after a gap would outshine the rest.
        energy = np.minimum(size, np.percentile(size, 95.0)) ** 2 if size.size else size
        axis = int(np.argmax(energy.sum(axis=0)))
        summed = np.concatenate([[0.0], np.cumsum(energy[:, axis])])
        ends = np.searchsorted(self.t, self.t + SHOWN_S)
        inside = np.maximum(ends, np.arange(len(ends)))
        best = int(np.argmax(summed[inside] - summed[:-1])) if len(ends) else 0
        shown = slice(best, int(inside[best]) if len(ends) else 0)
        return Imprint(EARTH[axis], self.t[shown] - t0, left[shown, axis], made[shown, axis])


def _inside(block: Block, t: float) -> bool:
    return block.start - 1e-6 <= t <= block.end + 1e-6


def rms(x: Array) -> float:
    """Root mean square of what is a number."""
    seen = x[np.isfinite(x)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")
