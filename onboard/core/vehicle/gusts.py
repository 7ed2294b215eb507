"""Means of non-linear forces in gusty air: squares of a speed that scatters are larger.

For a normal gust g of standard deviation sigma along an axis::

    E |u + g| (u + g)    = (u^2 + s^2) erf(u / (s sqrt 2)) + u s sqrt(2 / pi) exp(-u^2 / (2 s^2))
    E max(0, u + g)^2    = half of (that + u^2 + s^2)

Both from the moments of the truncated normal distribution (N. L. Johnson, S. Kotz and N.
Balakrishnan, *Continuous Univariate Distributions*, 1994, section 13.10.1).
"""

from __future__ import annotations

import math

import numpy as np

from onboard.core.maths.arrays import Array

LEAST_VARIANCE = 1e-6

_P = 0.3275911
_A = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)


def _erf(x: Array) -> Array:
    """The error function to 1.5e-7 (M. Abramowitz and I. Stegun, 1964, 7.1.26)."""
    t = 1.0 / (1.0 + _P * np.abs(x))
    series = t * (_A[0] + t * (_A[1] + t * (_A[2] + t * (_A[3] + t * _A[4]))))
    out: Array = np.sign(x) * (1.0 - series * np.exp(-x * x))
    return out


def signed_square(u: Array, variance: Array | float) -> Array:
    """(n, ...) mean of ``|u + g| (u + g)``; continued oddly to negative variances."""
    plain: Array = np.abs(u) * u
    size = np.abs(variance)
    if np.max(size) < LEAST_VARIANCE:
        return plain
    s = np.sqrt(np.maximum(size, LEAST_VARIANCE))
    ratio = u / s
    mean = (u * u + s * s) * _erf(ratio / math.sqrt(2.0))
    mean = mean + u * s * math.sqrt(2.0 / math.pi) * np.exp(-0.5 * ratio * ratio)
    odd = np.where(np.greater(variance, 0.0), mean, 2.0 * plain - mean)
    out: Array = np.where(size < LEAST_VARIANCE, plain, odd)
    return out


def positive_square(u: Array, variance: Array | float, signed: Array) -> Array:
    """(n,) mean of ``max(0, u + g)^2``; ``signed`` (n,) is :func:`signed_square` of the same."""
    out: Array = 0.5 * (signed + u * u + variance)
    return out
