"""Unevenly timed samples between their times: cubic Hermite, local, fourth order.

Streams are sent at whole milliseconds by a scheduler with other things to do, so the spacing of
samples wanders.  A straight line between samples at 25 or 50 Hz loses 1-2 % of the amplitude of a
2 Hz manoeuvre, which is the size of the scale errors that are looked for.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain


class Hermite:
    """Cubic Hermite interpolant with three-point slopes (exact for parabolas)."""

    __slots__ = ("_cubics", "_powers", "_shape", "_t")

    @property
    def t(self) -> Array:
        """(n,) times of the samples, s."""
        return self._t

    @property
    def cubics(self) -> Array:
        """(n - 1, 4, d) powers of the share of each interval."""
        return self._cubics

    def __init__(self, t: Array, x: Array) -> None:
        """Take samples ``x`` (n, ...) at strictly increasing times ``t`` (n,), n >= 2."""
        self._t = t
        self._shape = x.shape[1:]
        flat = x.reshape(len(t), -1)
        loops = compiled_loops()
        if loops is not None:
            self._t, flat = plain(t), plain(flat)
            self._cubics = np.empty((len(t) - 1, 4, flat.shape[1]))
            loops.cubics(self._t, flat, self._cubics)
            return
        h = np.diff(t)[:, None]
        slope = np.gradient(flat, t, axis=0, edge_order=2 if len(t) > 2 else 1)
        start, end, rise = h * slope[:-1], h * slope[1:], np.diff(flat, axis=0)
        # Powers of the share of the interval, each by itself: looked up one after the other they
        # stay in the cache, and take half of the time that they do side by side.
        self._powers = (
            flat[:-1],
            start,
            3.0 * rise - 2.0 * start - end,
            start + end - 2.0 * rise,
        )

    def __call__(self, at: Array) -> Array:
        """Values (*at.shape, ...) at times ``at``; outside the samples the end cubic goes on."""
        times = np.asarray(at, np.float64).ravel()
        loops = compiled_loops()
        if loops is not None:
            found = np.empty((len(times), self._cubics.shape[2]))
            loops.values(self._t, self._cubics, plain(times), found)
            return found.reshape(*np.shape(at), *self._shape)
        i = np.clip(np.searchsorted(self._t, times, side="right") - 1, 0, len(self._t) - 2)
        t0 = self._t[i]
        u = ((times - t0) / (self._t[i + 1] - t0))[:, None]
        zero, one, two, three = self._powers
        value: Array = three.take(i, axis=0)
        value *= u
        for power in (two, one):
            value += power.take(i, axis=0)
            value *= u
        value += zero.take(i, axis=0)
        return value.reshape(*np.shape(at), *self._shape)


def straight(t: Array, x: Array, at: Array) -> Array:
    """(*at.shape, d) by straight lines between samples ``x`` (n, d), the ends held.

    Args:
        t: (n,) times of the samples, s.
        x: the samples.
        at: times of any shape, s.
    """
    if len(t) < 2:
        return np.broadcast_to(x[0], (*np.shape(at), x.shape[1]))
    loops = compiled_loops()
    if loops is not None:
        found = np.empty((np.size(at), x.shape[1]))
        loops.straight(plain(t), plain(x), plain(at).ravel(), found)
        return found.reshape(*np.shape(at), x.shape[1])
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    share = np.clip((at - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)[..., None]
    out: Array = x[i] + share * (x[i + 1] - x[i])
    return out


def curved(t: Array, x: Array, at: Array) -> Array:
    """(*at.shape,) by the cubics of :class:`Hermite`, where samples are near; the ends held.

    A straight line between samples of what swings within a few of them is smoother than it, and
    what goes in proportion is found too large.  Where samples are missing nobody knows the slope at
    either end as well as that is asked for: there the line is straight.

    Args:
        t: (n,) times of the samples, s.
        x: (n,) the samples.
        at: times of any shape, s.
    """
    lines: Array = np.interp(at, t, x)
    h = np.diff(t)
    if len(h) < 2 or h.min() <= 0.0:
        return lines
    near = h < 2.0 * np.median(h)
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(h) - 1)
    inside = near[i] & (at >= t[0]) & (at <= t[-1])
    return np.where(inside, Hermite(t, x[:, None])(at)[..., 0], lines)
