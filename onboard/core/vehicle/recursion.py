"""Recursions of first order over a flight, without a loop over time.

``y_k = z_k + a y_(k-1)`` is a sum of shifted copies with weights 1, a, a^2 ...; doubling adds them
in as many turns as the length has binary digits.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask

NEGLIGIBLE = 1e-12
SHORTEST_LAG_S = 0.005
"""A tenth of a step of 0.05 s, of which exp(-10) is left a step later: a shorter lag acts in
proportion to its length, and a law of that is what a fit needs at none [cost: rounding]."""
LONGEST_LAG_S = 1.0
"""Slower than this no motor and no servo is, s [physics]."""


def accumulated(z: Array, factor: float, starts: Mask | None = None) -> Array:
    """``y_k = z_k + factor y_(k-1)`` along the first axis of z (n, ...), y_(-1) = 0.

    Args:
        z: (n, ...).
        factor: at most one in size.
        starts: (n,) where the sum begins anew; nowhere but at the first if None.
    """
    out = z.copy()
    weight = np.full(len(z), factor)
    if starts is not None:
        weight[starts] = 0.0
    shape = (-1,) + (1,) * (z.ndim - 1)
    shift = 1
    while shift < len(out) and factor > NEGLIGIBLE:
        out[shift:] += weight[shift:].reshape(shape) * out[:-shift]
        weight[shift:] *= weight[:-shift].copy()
        shift, factor = 2 * shift, factor * factor
    return out


def starts_of(piece: NDArray[np.int64]) -> Mask:
    """(n,) where an uninterrupted piece begins, by its number (n,)."""
    out: Mask = np.concatenate([[True], np.diff(piece) != 0])
    return out


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
    starts = starts_of(piece)
    drive = np.empty_like(x)
    drive[1:] = (1.0 - slope) * x[1:] + (slope - decay) * x[:-1]
    drive[starts] = x[starts]
    return accumulated(drive, decay, starts)


def behind(x: Array, lag: float, piece: NDArray[np.int64], step_s: float) -> Array:
    """A signal x (n, k) behind a low-pass; a lag that is less than none leads by as much.

    A fit needs a slope everywhere.  Where a lag of less than the shortest acted as the shortest, a
    prior that asks for more would turn every step of the fit into one that leads uphill, and leave
    all other unknowns where they were.

    Args:
        x: the signal.
        lag: time constant, s; at most :data:`LONGEST_LAG_S` either way.
        piece: (n,) number of the uninterrupted piece; each begins settled.
        step_s: s.
    """
    lag = min(max(lag, -LONGEST_LAG_S), LONGEST_LAG_S)
    tau = max(abs(lag), SHORTEST_LAG_S)
    out: Array = x + lag / tau * (lagged(x, tau, piece, step_s) - x)
    return out


def ahead(x: Array, by: float, piece: NDArray[np.int64], step_s: float) -> Array:
    """A signal x (n, k) as it is ``by`` later, s; ends of a piece are held.

    Cubics through four steps (E. Catmull and R. Rom, *A class of local interpolating splines*,
    1974): straight lines would take from what is fast as a low-pass does.
    """
    by = min(by, LONGEST_LAG_S)
    whole, share = divmod(by / step_s, 1.0)
    edges = np.flatnonzero(starts_of(piece))
    last = np.append(edges[1:], len(x))[np.searchsorted(edges, np.arange(len(x)), "right") - 1] - 1
    first = np.repeat(edges, np.diff(np.append(edges, len(x))))
    here = np.arange(len(x)) + int(whole)
    a, b, c, d = (x[np.clip(here + k, first, last)] for k in (-1, 0, 1, 2))
    s = share
    out: Array = b + 0.5 * s * (
        c - a + s * (2.0 * a - 5.0 * b + 4.0 * c - d + s * (3.0 * (b - c) + d - a))
    )
    return out
