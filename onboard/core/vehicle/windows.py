"""Means over a few steps: the rows of a fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import WINDOW_STEPS


@dataclass(frozen=True, slots=True)
class Windows:
    """Which steps make which row.

    Attributes:
        first: (r,) first step of each window.
        counts: (r,) steps in it.
        piece: (r,) uninterrupted piece of flight that it belongs to.
        length_s: nominal length, s.
    """

    first: NDArray[np.intp]
    counts: NDArray[np.intp]
    piece: NDArray[np.int64]
    length_s: float

    def mean(self, x: Array) -> Array:
        """(r, ...) means of (n, ...) over the windows."""
        shape = (-1,) + (1,) * (x.ndim - 1)
        out: Array = np.add.reduceat(x, self.first, axis=0) / self.counts.reshape(shape)
        return out


def windows_of(flight: Flight) -> Windows:
    """Windows of a flight; none spans two pieces."""
    edges = np.flatnonzero(np.diff(flight.piece)) + 1
    starts = [
        np.arange(part[0], part[-1] + 1, WINDOW_STEPS)
        for part in np.split(np.arange(len(flight)), edges)
    ]
    first = np.concatenate(starts)
    counts = np.diff(np.append(first, len(flight)))
    return Windows(first, counts, flight.piece[first], WINDOW_STEPS * flight.step_s)
