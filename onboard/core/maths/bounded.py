"""Estimates of which some numbers can only be within a range."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array


def bounded(x: Array, C: Array, low: Array, high: Array) -> Array:
    """The likeliest values within ranges of what is normally distributed.

    The minimum of ``(z - x)^T C^-1 (z - x)`` with ``low <= z <= high``, by active sets: what is
    furthest outside goes to the end of its range and pulls what it trades with along; an end that
    pulls outwards is let go.

    Args:
        x: (n,) mean.
        C: (n, n) covariance, positive definite.
        low: (n,) least values; minus infinity: none.
        high: (n,) largest values, none less than ``low``.

    Returns:
        (n,) values.
    """
    sigma = np.sqrt(np.diag(C))
    free = low < high
    held: dict[int, float] = {}
    z = x
    for _ in range(4 * len(x)):  # each set is better than the one before; nothing goes on for long
        at = list(held)
        pull = np.linalg.solve(C[np.ix_(at, at)], np.array(list(held.values())) - x[at])
        loose = [
            i
            for i, by in zip(at, pull.tolist(), strict=True)
            if free[i] and (by < 0.0) == (held[i] == low[i])
        ]
        if loose:
            del held[loose[0]]
            continue
        z = x + C[:, at] @ pull
        z[at] = list(held.values())
        outside = np.maximum(low - z, z - high) / sigma
        outside[at] = -np.inf
        worst = int(np.argmax(outside))
        if outside[worst] <= 0.0:
            break
        held[worst] = float(low[worst] if z[worst] < low[worst] else high[worst])
    return np.clip(z, low, high)
