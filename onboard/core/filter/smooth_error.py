"""A slow error that is smooth: Matern 3/2, critically damped and driven by white noise.

The heading that an EKF reports is carried by a gyroscope at the autopilot's full rate, and pulled
over some seconds towards a compass or a course over ground.  From one moment to the next it errs no
more than the gyroscope does.  A Gauss-Markov process jumps between any two moments instead: its
level is then either too small for what the heading errs by in a minute, or too large for what it
errs by in a second.  With ``k = 1 / time``, the error ``x`` and its rate ``u`` follow ``x' = u``,
``u' = -k^2 x - 2 k u + noise`` of density ``4 k^3 sigma^2``; settled, their variances are
``sigma^2`` and ``k^2 sigma^2`` (Hartikainen and Sarkka, 2010).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.filter.limits import HEADING_TIME_S
from onboard.core.maths.arrays import Array

_K: Final = 1.0 / HEADING_TIME_S
SETTLED_RATE: Final = _K**2
"""Variance of the rate, 1/s^2, of an error that has a variance of one."""
RATE_WALK: Final = 4.0 * _K**3
"""Density of the noise that drives the rate, 1/s^3."""


def moved(duration: float) -> tuple[float, Array]:
    """How the error and its rate follow from those before: the exact transition.

    Args:
        duration: s.

    Returns:
        What the error leaves of itself; and (3,) what its rate adds to it, what the error leaves of
        the rate, and what the rate leaves of itself.
    """
    x = _K * duration
    shrunk = math.exp(-x)
    swing = np.array([duration * shrunk, -_K * x * shrunk, (1.0 - x) * shrunk])
    return (1.0 + x) * shrunk, swing
