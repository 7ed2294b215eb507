"""Unevenly timed samples between their times: cubic Hermite, local, fourth order.

Streams are sent at whole milliseconds by a scheduler with other things to do, so the spacing of
samples wanders.  A straight line between samples at 25 or 50 Hz loses 1-2 % of the amplitude of a
2 Hz manoeuvre, which is the size of the scale errors that are looked for.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array


class Hermite:
    """Cubic Hermite interpolant with three-point slopes (exact for parabolas)."""

    __slots__ = ("_slope", "_t", "_x")

    def __init__(self, t: Array, x: Array) -> None:
        """Take samples ``x`` (n, ...) at strictly increasing times ``t`` (n,), n >= 2."""
        self._t = t
        self._x = x
        self._slope = np.gradient(x, t, axis=0, edge_order=2 if len(t) > 2 else 1)

    def __call__(self, at: Array) -> Array:
        """Values (*at.shape, ...) at times ``at``; outside the samples the end cubic goes on."""
        i = np.clip(np.searchsorted(self._t, at, side="right") - 1, 0, len(self._t) - 2)
        t0 = self._t[i]
        h = self._t[i + 1] - t0
        extra = (1,) * (self._x.ndim - 1)
        u = ((at - t0) / h).reshape(*at.shape, *extra)
        step = h.reshape(*at.shape, *extra)
        u2 = u * u
        rest = 1.0 - u
        rest2 = rest * rest
        value: Array = (
            self._x[i] * ((1.0 + 2.0 * u) * rest2)
            + self._x[i + 1] * (u2 * (3.0 - 2.0 * u))
            + step * (self._slope[i] * (u * rest2) - self._slope[i + 1] * (u2 * rest))
        )
        return value
