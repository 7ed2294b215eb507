"""Sums of whitened rows of a block of flight, about an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class BlockSums:
    """Sums ``N = sum h h^T``, ``b = sum h y``, ``s = sum y^2`` of the unknowns that act in a block.

    Attributes:
        N: (d, d).
        b: (d,).
        s: of what is measured.
        rows: how many.
        places: (d,) which of all unknowns they are of, in order: a flight knows nothing of those
            that are another one's.
        part: which of several recordings they are of.
    """

    N: Array
    b: Array
    s: float
    rows: int
    places: NDArray[np.intp]
    part: int = 0

    def of(self, unknowns: Sequence[int] | NDArray[np.intp]) -> tuple[Array, Array]:
        """N (u, u) and b (u,) of these of all unknowns; zero of what does not act here."""
        asked = np.asarray(unknowns, dtype=np.intp)
        at = np.minimum(np.searchsorted(self.places, asked), len(self.places) - 1)
        acts = self.places[at] == asked
        N = np.where(np.outer(acts, acts), self.N[np.ix_(at, at)], 0.0)
        return N, np.where(acts, self.b[at], 0.0)

    def times(self, x: Array) -> Array:
        """(d,) ``N x`` of all unknowns (m,)."""
        out: Array = self.N @ x[self.places]
        return out


def total(blocks: Sequence[BlockSums], size: int) -> tuple[Array, Array, float]:
    """N (m, m), b (m,) and s of some blocks."""
    N, b = np.zeros((size, size)), np.zeros(size)
    for block in blocks:
        N[np.ix_(block.places, block.places)] += block.N
        b[block.places] += block.b
    return N, b, float(sum(block.s for block in blocks))
