"""Flicker noise over a span: the floor of a sensor's Allan deviation, as a sum of cosines.

Noise of the two-sided density ``B^2 / (2 pi f)`` has the bias instability ``B`` (IEEE Std 952-1997,
annex C): its Allan deviation is ``0.664 B`` at every time of averaging.  About its mean over a span
``T`` it is taken for a sum of

    c_k(t) = sqrt(2) cos(pi k (t - start) / T),    k = 1 ... n,

of unit mean square, which are independent and stand for the frequencies about ``k / (2 T)``: their
amplitudes have the variance ``B^2 / (pi k)``, whatever the span is (that of the slowest is a fifth
less: a cosine is not quite what a span of it is made of).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array

MEANS_APART: Final = 4.0 * math.log(2.0) / math.pi
"""Variance by which the means of neighbouring spans differ, of unit instability: twice Allan's."""


def waves(t: Array, start: float, end: float, count: int) -> Array:
    """``c_1`` to ``c_count`` at times of any shape, s: (..., count)."""
    k = np.arange(1, count + 1)
    out: Array = math.sqrt(2.0) * np.cos(np.pi * k * ((t - start) / (end - start))[..., None])
    return out


def waves_variance(count: int) -> Array:
    """(count,) variances of their amplitudes, of unit instability."""
    out: Array = np.asarray(1.0 / (np.pi * np.arange(1, count + 1)), dtype=np.float64)
    return out
