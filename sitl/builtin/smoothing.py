"""Smooth signals on a regular grid, numpy only: moving averages, derivatives, integrals.

Trajectories are commands (piecewise constant) passed through cascades of *causal* moving
averages: the past never depends on a later command, and the integral of a command survives,
so that a flight planned from commands lands where it was planned to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

RATE = 1000
"""Samples per second of every physical array."""

DT = 1.0 / RATE


def moving_average(x: Array, window_s: float) -> Array:
    """Causal moving average along axis 0; before its start ``x`` is taken as ``x[0]``."""
    w = max(1, round(window_s * RATE))
    start = x[0]
    total = np.cumsum(x - start, axis=0)
    out = total.copy()
    out[w:] -= total[:-w]
    mean: Array = out / w + start
    return mean


def smooth(x: Array, windows_s: Sequence[float]) -> Array:
    """Cascade of moving averages: k windows make the result k - 1 times differentiable."""
    for window in windows_s:
        x = moving_average(x, window)
    return x


def derivative(x: Array) -> Array:
    """Time derivative along axis 0: fourth-order central differences, first order at the ends."""
    d = np.empty_like(x)
    d[2:-2] = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / (12.0 * DT)
    d[1] = (x[2] - x[0]) / (2.0 * DT)
    d[-2] = (x[-1] - x[-3]) / (2.0 * DT)
    d[0] = (x[1] - x[0]) / DT
    d[-1] = (x[-1] - x[-2]) / DT
    return d


def integral(x: Array) -> Array:
    """Running integral along axis 0 by the trapezoidal rule, zero at the first sample."""
    out = np.zeros_like(x)
    np.cumsum(0.5 * DT * (x[1:] + x[:-1]), axis=0, out=out[1:])
    return out


def band_limited_noise(
    rng: np.random.Generator, n: int, sigma: float, windows_s: Sequence[float]
) -> Array:
    """(n,) smooth random signal of standard deviation ``sigma``.

    White numbers at 20 Hz held and smoothed; a shorter ``n`` gives a prefix of a longer one.
    """
    hold = RATE // 20
    white = rng.standard_normal(n // hold + 2)
    kernel = np.repeat(white, hold)[:n]
    gain = _noise_gain(windows_s, hold)
    return smooth(kernel - 0.0, windows_s) * (sigma / gain)


def _noise_gain(windows_s: Sequence[float], hold: int) -> float:
    """Standard deviation after smoothing of held unit white noise."""
    impulse = np.zeros(hold + 1 + sum(round(w * RATE) for w in windows_s))
    impulse[1 : hold + 1] = 1.0
    response = smooth(impulse, windows_s)
    return float(np.sqrt(np.sum(response**2) / hold))


def staircase(n: int, times_s: Sequence[float], values: Sequence[float] | Array) -> Array:
    """(n,) signal that takes ``values[i]`` from ``times_s[i]`` on; zero before the first."""
    out = np.zeros(n)
    marks = [min(n, max(0, round(t * RATE))) for t in times_s] + [n]
    for value, begin, end in zip(values, marks[:-1], marks[1:], strict=True):
        out[begin:end] = value
    return out
