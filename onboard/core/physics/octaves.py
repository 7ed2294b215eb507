"""Three of a kind, an octave apart: how an effect shares its size where the law leaves it open.

How wide a loop is, or how quick a receiver's, nobody knows beforehand; what lies between two that
are an octave apart is much like both.  An effect is the weighted sum of three.  The sum of their
weights is its size, and how they share it are two shapes, which add nothing to the size and have
nothing of each other.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array

WEIGHTS: Final[Array] = np.array(
    [
        np.full(3, 1.0) / 3.0,
        np.array([1.0, 0.0, -1.0]) / math.sqrt(2.0),
        np.array([1.0, -2.0, 1.0]) / math.sqrt(6.0),
    ]
)
"""(3, 3) weights of the three by one unit of the size, of the first shape (more of the first than
of the last) and of the second (more of both than of the one in between)."""


def sigma_of_shapes(largest: float) -> float:
    """Prior of a shape, in the unit of the size.

    It is that of the largest size if all ways to share it among the three are equally likely.
    """
    return largest / math.sqrt(12.0)
