"""Derivatives of what is predicted, kept where they are not nothing.

In a fit of several flights most unknowns are of one flight alone (its wind, what its calibration
left), and nothing elsewhere.  As a column for each unknown they grow with the square of the number
of flights, and nearly all of it is zeros.  So unknowns that are the same thing in different flights
share a column, and where a column stands for which unknown is said beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.windows import Windows


@dataclass(frozen=True, slots=True)
class Columns:
    """Derivatives by m unknowns at n steps or rows.

    Attributes:
        by: (n, ..., d) the columns that unknowns share.
        places: (p, d) which unknown each column is of, in each of p recordings; in order.
        part: (n,) which recording a step is of.
        size: m.
    """

    by: Array
    places: NDArray[np.intp]
    part: NDArray[np.int64]
    size: int

    @property
    def whole(self) -> Array:
        """(n, ..., m) a column for each unknown."""
        if len(self.places) == 1:
            return self.by
        out = np.zeros((*self.by.shape[:-1], self.size))
        for number, its in enumerate(self.places):
            mine = self.part == number
            # An array beside a mask would be taken for one more of its axes.
            by = np.zeros((np.count_nonzero(mine), *out.shape[1:]))
            by[..., its] = self.by[mine]
            out[mine] = by
        return out

    def axis(self, k: int) -> Columns:
        """Of one of the axes of (n, k, d)."""
        return replace(self, by=self.by[:, k])

    def at(self, rows: Mask | NDArray[np.intp]) -> Columns:
        """Of some of the steps."""
        return replace(self, by=self.by[rows], part=self.part[rows])

    def means(self, windows: Windows) -> Columns:
        """Over windows, of which none spans two recordings."""
        return replace(self, by=windows.mean(self.by), part=self.part[windows.first])

    def times(self, x: Array) -> Array:
        """(n, ...) what unknowns that are off by x (m,) make, to first order."""
        out = np.zeros(self.by.shape[:-1])
        for number, its in enumerate(self.places):
            mine = self.part == number
            out[mine] = self.by[mine] @ x[its]
        return out

    def of(self, unknowns: Sequence[int]) -> Array:
        """(n, ..., u) a column for each of these unknowns."""
        out = np.zeros((*self.by.shape[:-1], len(unknowns)))
        for number, its in enumerate(self.places):
            mine = self.part == number
            column = {int(place): j for j, place in enumerate(its)}
            for at, unknown in enumerate(unknowns):
                if unknown in column:
                    out[mine, ..., at] = self.by[mine][..., column[unknown]]
        return out

    def inserted(self, place: int, by: Array) -> Columns:
        """With more unknowns before the one at a place, which all flights share: (n, ..., u)."""
        more = by.shape[-1]
        at = int(np.searchsorted(self.places[0], place))
        places = self.places + more * (self.places >= place)
        new = np.tile(np.arange(place, place + more), (len(places), 1))
        return replace(
            self,
            by=np.insert(self.by, [at] * more, by, axis=-1),
            places=np.hstack([places[:, :at], new, places[:, at:]]),
            size=self.size + more,
        )

    def normal(self, y: Array) -> tuple[Array, Array]:
        """``H^T H`` (m, m) and ``H^T y`` (m,) of rows (n, d) and what is measured (n,)."""
        N, b = np.zeros((self.size, self.size)), np.zeros(self.size)
        for number in np.unique(self.part).tolist():
            mine, its = self.part == number, self.places[number]
            h = self.by[mine]
            N[np.ix_(its, its)] += h.T @ h
            b[its] += h.T @ y[mine]
        return N, b
