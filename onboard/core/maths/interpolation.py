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

    __slots__ = ("_cubics", "_shape", "_t")

    def __init__(self, t: Array, x: Array) -> None:
        """Take samples ``x`` (n, ...) at strictly increasing times ``t`` (n,), n >= 2."""
        self._t = t
        self._shape = x.shape[1:]
        flat = x.reshape(len(t), -1)
        h = np.diff(t)[:, None]
        slope = np.gradient(flat, t, axis=0, edge_order=2 if len(t) > 2 else 1)
        start, end, rise = h * slope[:-1], h * slope[1:], np.diff(flat, axis=0)
        # Powers of the share of the interval, side by side: one look-up for each time asked for.
        self._cubics = np.stack(
            [flat[:-1], start, 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise], axis=1
        )

    def __call__(self, at: Array) -> Array:
        """Values (*at.shape, ...) at times ``at``; outside the samples the end cubic goes on."""
        times = np.asarray(at).ravel()
        i = np.clip(np.searchsorted(self._t, times, side="right") - 1, 0, len(self._t) - 2)
        t0 = self._t[i]
        u = ((times - t0) / (self._t[i + 1] - t0))[:, None]
        cubic = self._cubics[i]
        value: Array = cubic[:, 3] * u
        for power in (2, 1):
            value += cubic[:, power]
            value *= u
        value += cubic[:, 0]
        return value.reshape(*np.shape(at), *self._shape)
