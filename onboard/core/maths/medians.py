"""What medians are of: spreads by them do not move with a few that are far off."""

from typing import Final

NORMAL_MEDIAN: Final = 0.6745
"""Median size of what is normally distributed, in sigmas [probability]."""
NORMAL_THREE_QUARTERS: Final = 1.1503
"""Size below which three quarters of it are, in sigmas [probability]."""
MEDIAN_SQUARE: Final = 0.455
"""Median of chi-square with one degree of freedom [probability]."""
