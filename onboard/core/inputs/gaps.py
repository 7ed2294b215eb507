"""Gaps in inertial samples: what is between them, and which fixes they take."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.limits import EVEN_MARGIN_S, FEWEST_SAMPLES, IMU_GAP_S
from onboard.core.inputs.reach import Reach
from onboard.core.maths.arrays import Array, Mask


def mean_step(t: Array) -> float:
    """Mean time between samples at ``t`` (n,), s; inf if there are none so close.

    A gap does not make the rest of them slow, nor a clock that begins anew the rest of them fast.
    """
    steps = np.diff(t)
    close = steps[(steps >= 0.0) & (steps <= IMU_GAP_S)]
    return float(np.mean(close)) if len(close) else np.inf


def beside_gaps(t: Array, epochs: Array, reach: Reach) -> Mask:
    """(k,) which of the fixes at ``epochs`` lack samples at ``t`` that they need: gaps in them."""
    before = np.flatnonzero(np.diff(t) > IMU_GAP_S)
    # The first gap that ends after what a fix needs begins.
    next_ = np.searchsorted(t[before + 1], epochs - reach.before + EVEN_MARGIN_S, side="right")
    begins = np.append(t[before], np.inf)
    out: Mask = begins[next_] < epochs + reach.after
    return out


def pieces_of(
    t: Array, epochs: Array, reach: Reach
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Pieces without inertial gaps: indices of the samples needed, and of the fixes inside."""
    breaks = np.flatnonzero(np.diff(t) > IMU_GAP_S) + 1
    for piece in np.split(np.arange(len(t)), breaks):
        if len(piece) < FEWEST_SAMPLES:
            continue
        begin, end = t[piece[0]] + reach.before - EVEN_MARGIN_S, t[piece[-1]] - reach.after
        inside = np.flatnonzero((epochs >= begin) & (epochs <= end))
        if len(inside) == 0:
            continue
        needed = piece[needed_of(t[piece], epochs[inside], reach)]
        if len(needed) >= FEWEST_SAMPLES:
            yield needed, inside


def needed_of(t: Array, epochs: Array, reach: Reach) -> slice:
    """The samples at ``t`` that fixes at ``epochs`` need, to either side of them."""
    return slice(
        int(np.searchsorted(t, epochs[0] - reach.before - EVEN_MARGIN_S)),
        int(np.searchsorted(t, epochs[-1] + reach.ahead)),
    )
