"""Recursions of first order over a flight, without a loop over time.

``y_k = z_k + a y_(k-1)`` is a sum of shifted copies with weights 1, a, a^2 ...; doubling adds them
in as many turns as the length has binary digits.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array

NEGLIGIBLE = 1e-12


def accumulated(z: Array, factor: float) -> Array:
    """``y_k = z_k + factor y_(k-1)`` along the first axis of z (n, ...), y_(-1) = 0."""
    out = z.copy()
    shift = 1
    while shift < len(out) and factor > NEGLIGIBLE:
        moved = factor * out[:-shift]
        out[shift:] += moved
        shift, factor = 2 * shift, factor * factor
    return out


def pieces_of(piece: NDArray[np.int64]) -> list[NDArray[np.intp]]:
    """Indices of each uninterrupted piece, by its number (n,)."""
    edges = np.flatnonzero(np.diff(piece)) + 1
    return np.split(np.arange(len(piece)), edges)


def lagged(x: Array, tau: float, piece: NDArray[np.int64], step_s: float) -> Array:
    """A signal x (n, k) behind a low-pass of first order; exact for straight lines between steps.

    Args:
        x: the signal.
        tau: time constant, s.
        piece: (n,) number of the uninterrupted piece; each begins settled.
        step_s: s.
    """
    decay = math.exp(-step_s / tau)
    slope = tau / step_s * (1.0 - decay)
    out = np.empty_like(x)
    for part in pieces_of(piece):
        own = x[part]
        drive = np.zeros_like(own)
        drive[1:] = (1.0 - slope) * own[1:] + (slope - decay) * own[:-1]
        drive[0] = own[0]
        out[part] = accumulated(drive, decay)
    return out
