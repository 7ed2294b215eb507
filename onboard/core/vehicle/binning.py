"""Data in bins, for curves with their data."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.limits import CURVE_BINS

FEWEST_IN_BIN = 5
MOST_POINTS = 400
"""Single steps that are kept of a curve, to be drawn [cost]."""


def binned(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Middle, mean and scatter of y (n,) in even bins of x (n,); only bins with enough data."""
    if len(x) == 0 or float(np.ptp(x)) <= 0.0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    edges = np.linspace(float(x.min()), float(x.max()), CURVE_BINS + 1)
    which = np.clip(np.digitize(x, edges) - 1, 0, CURVE_BINS - 1)
    middle, mean, spread = [], [], []
    for k in range(CURVE_BINS):
        mine = which == k
        if np.count_nonzero(mine) >= FEWEST_IN_BIN:
            middle.append(float(np.mean(x[mine])))
            mean.append(float(np.mean(y[mine])))
            spread.append(float(np.std(y[mine])))
    return np.array(middle), np.array(mean), np.array(spread)


def thinned(x: Array, y: Array) -> Array:
    """(p, 2) even share of the points (n,) in order of x, the first and the last among them."""
    order = np.argsort(x, kind="stable")
    if len(order) > MOST_POINTS:
        order = order[np.linspace(0, len(order) - 1, MOST_POINTS).astype(np.intp)]
    out: Array = np.column_stack([x[order], y[order]])
    return out
