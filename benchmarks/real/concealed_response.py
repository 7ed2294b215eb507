"""How a receiver weighs what is around a fix: an antenna put elsewhere goes through it as well.

The spans and shares are those that a flight tells; what they stand for is this package's own.  An
antenna's velocity that went through an even mean where the rest went through a first-order lag
would be a receiver's that there is not: what it lacks of fast turns would count as a shorter arm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES = 24
"""Moments that stand for a shape without jumps."""


def at_once() -> Array:
    """(2, 1) of a receiver that does not average."""
    return np.array([[0.0], [1.0]])


def weighed(window: float, shares: Sequence[float], apart: float) -> Array:
    """Moments (s, later is more) in the first row, weights in the second: (2, K).

    All shapes have their mean at nothing and the standard deviation of ``window`` held evenly.

    Args:
        window: span, s.
        shares: of two moments the newer of which weighs more, of two the older of which does, of
            half of what two make when the newer weighs 3 to 1 less when the older does, and of a
            first-order lag.  What is left is even.
        apart: of the two moments, s.
    """
    if window <= 0.0:
        return at_once()
    sigma = window / np.sqrt(12.0)
    p = 0.5 - np.sqrt(max(0.25 - (sigma / apart) ** 2, 0.0))
    newer, older, leaning, lagging = shares
    middles = (np.arange(NODES) + 0.5) / NODES
    quantiles = 1.0 + np.log1p(-middles)
    quantiles *= 1.0 / np.std(quantiles)
    parts = [
        (1.0 - newer - older - lagging, (middles - 0.5) * window, np.full(NODES, 1.0 / NODES)),
        (newer, *_two(sigma, p)),
        (older, *_two(sigma, 1.0 - p)),
        (0.5 * leaning, *_two(sigma, 0.25)),
        (-0.5 * leaning, *_two(sigma, 0.75)),
        (lagging, sigma * (quantiles - quantiles.mean()), np.full(NODES, 1.0 / NODES)),
    ]
    moments = np.concatenate([t for share, t, _ in parts if share])
    return np.stack([moments, np.concatenate([share * w for share, _, w in parts if share])])


def _two(sigma: float, older: float) -> tuple[Array, Array]:
    """Moments and weights of two, of which the older has the weight ``older``."""
    apart = sigma / np.sqrt(older * (1.0 - older))
    return np.array([older * apart, (older - 1.0) * apart]), np.array([1.0 - older, older])
