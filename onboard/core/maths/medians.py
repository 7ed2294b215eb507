"""What medians are of: spreads by them do not move with a few that are far off."""

from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array

NORMAL_MEDIAN: Final = 0.6745
"""Median size of what is normally distributed, in sigmas [probability]."""
NORMAL_THREE_QUARTERS: Final = 1.1503
"""Size below which three quarters of it are, in sigmas [probability]."""
MEDIAN_SQUARE: Final = 0.455
"""Median of chi-square with one degree of freedom [probability]."""


def middle(x: Array) -> float:
    """Median of a few hundred finite numbers (n,), n > 0: numpy's own takes five times as long."""
    ordered = np.sort(x)
    half = len(ordered) // 2
    return 0.5 * float(ordered[half] + ordered[len(ordered) - 1 - half])
