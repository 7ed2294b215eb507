"""Recursions of first order over a flight, without a loop over time.

``y_k = z_k + a y_(k-1)`` is a sum of shifted copies with weights 1, a, a^2 ...; doubling adds them
in as many turns as the length has binary digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask

Law: TypeAlias = Callable[[Array, float, NDArray[np.int64], float], Array]
"""A signal (n, k) changed by a time, s, piece by piece (n,), on a grid of a step, s."""

NEGLIGIBLE = 1e-12
SHORTEST_LAG_S = 0.005
"""A tenth of a step of 0.05 s, of which exp(-10) is left a step later: a shorter lag acts in
proportion to its length, and a law of that is what a fit needs at none [cost: rounding]."""
LONGEST_LAG_S = 1.0
"""Slower than this no motor and no servo is, s [physics]."""


def accumulated(z: Array, factor: float | Array, starts: Mask | None = None) -> Array:
    """``y_k = z_k + factor y_(k-1)`` along the first axis of z (n, ...), y_(-1) = 0.

    Args:
        z: (n, ...).
        factor: at most one in size; of each column (c,) its own, if z is (n, c).
        starts: (n,) where the sum begins anew; nowhere but at the first if None.
    """
    out = z.copy()
    weight: float | Array = factor
    # Nothing comes before the first anyway: only where a later piece begins some go without.
    goes_on = None
    if starts is not None and starts[1:].any():
        goes_on = np.where(starts, 0.0, 1.0).reshape((-1,) + (1,) * (z.ndim - 1))
    shift = 1
    while shift < len(out) and np.max(weight) > NEGLIGIBLE:
        before = weight * out[:-shift]
        if goes_on is not None:
            before *= goes_on[shift:]
            goes_on[shift:] *= goes_on[:-shift].copy()
        out[shift:] += before
        shift, weight = 2 * shift, weight * weight
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


class Remembered:
    """A law's last answer: a fit asks for the same lag once for every other unknown."""

    def __init__(self) -> None:
        """Nothing was asked yet."""
        self._asked: tuple[Law, Array, float, NDArray[np.int64], float] | None = None
        self._answer = np.zeros(0)

    def __call__(
        self, law: Law, x: Array, lag: float, piece: NDArray[np.int64], step_s: float
    ) -> Array:
        """As the law itself; a signal and its pieces that were asked about are not changed."""
        last = self._asked
        same = last is not None and last[1] is x and last[3] is piece
        if last is None or not same or (last[0], last[2], last[4]) != (law, lag, step_s):
            self._answer = law(x, lag, piece, step_s)
            self._asked = law, x, lag, piece, step_s
        return self._answer


def ahead(x: Array, by: float, piece: NDArray[np.int64], step_s: float) -> Array:
    """A signal x (n, k) as it is ``by`` later, s; ends of a piece are held.

    Cubics through four steps (E. Catmull and R. Rom, *A class of local interpolating splines*,
    1974): straight lines would take from what is fast as a low-pass does.
    """
    by = min(by, LONGEST_LAG_S)
    whole, share = divmod(by / step_s, 1.0)
    edges = np.flatnonzero(starts_of(piece))
    ends = np.append(edges[1:], len(x))
    first, last = np.repeat([edges, ends - 1], ends - edges, axis=1)
    here = np.arange(len(x)) + int(whole)
    a, b, c, d = (np.take(x, np.clip(here + k, first, last), axis=0) for k in (-1, 0, 1, 2))
    s = share
    out: Array = b + 0.5 * s * (
        c - a + s * (2.0 * a - 5.0 * b + 4.0 * c - d + s * (3.0 * (b - c) + d - a))
    )
    return out
