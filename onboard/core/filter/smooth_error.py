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

import numpy as np

from onboard.core.maths.arrays import Array


def settled_rate(time: Array) -> Array:
    """Variances of the rates, 1/s^2, of errors that have a variance of one, by their times, s."""
    out: Array = time**-2.0
    return out


def rate_walk(time: Array) -> Array:
    """Densities of the noise that drives these rates, 1/s^3."""
    out: Array = 4.0 * time**-3.0
    return out


def moved(duration: float, time: Array) -> tuple[Array, Array]:
    """How errors and their rates follow from those before: the exact transition.

    Args:
        duration: s.
        time: (B,) of each error, s.

    Returns:
        (B,) what an error leaves of itself; and (B, 3) what its rate adds to it, what the error
        leaves of the rate, and what the rate leaves of itself.
    """
    x = duration / time
    shrunk = np.exp(-x)
    swing = np.empty((len(time), 3))
    swing[:, 0], swing[:, 1] = duration * shrunk, -x / time * shrunk
    swing[:, 2] = (1.0 - x) * shrunk
    return (1.0 + x) * shrunk, swing
