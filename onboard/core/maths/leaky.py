"""Leaky integrals along an uneven time axis, without a loop over it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array

PIECE: Final = 200
"""Steps that are summed at once [cost]."""
MOST_PIECE: Final = 300.0
"""Time constants of a piece, past which nothing of its beginning is left [bound: the square of
e^300 is a number still].  A step of more than its share is a piece of its own."""


def leaky_integral(
    t: Array, gained: NDArray[Any], pole: NDArray[Any], start: NDArray[Any]
) -> NDArray[Any]:
    """``z' = pole z + x`` from moment to moment, each step's gain at its middle: (n, m).

    What has leaked is put back before it is summed, a piece at a time: after minutes it would be
    too large a number.

    Args:
        t: (n,) s, in order.
        gained: (n - 1, m) integral of x over each step.
        pole: (m,) 1/s, real or complex, of negative real parts.
        start: (m,) z at the first moment.
    """
    z = np.zeros((len(t), len(start)), dtype=np.result_type(gained, pole, start))
    z[0] = start
    gap = np.flatnonzero(np.diff(t) * np.max(-pole.real) > MOST_PIECE / PIECE)
    ends = np.unique(np.concatenate([np.arange(0, len(t) - 1, PIECE), gap, gap + 1, [len(t) - 1]]))
    for i, j in pairwise(ends.tolist()):
        since = (t[i : j + 1] - t[i])[:, None]
        size = np.exp(np.maximum(since * pole.real, -MOST_PIECE))
        left, middle = size[1:], np.sqrt(size[1:] * size[:-1])
        if np.iscomplexobj(z):
            turned = 1j * pole.imag
            left = left * np.exp(turned * since[1:])
            middle = middle * np.exp(turned * 0.5 * (since[1:] + since[:-1]))
        z[i + 1 : j + 1] = left * (z[i] + np.cumsum(gained[i:j] / middle, axis=0))
    return z
