"""Student's t and Fisher's F: what is chance where the variance is only estimated.

Sources: NIST Digital Library of Mathematical Functions, 8.17.5 and 8.17.22 (the continued fraction
of the incomplete beta function), evaluated as Lentz does.
"""

from __future__ import annotations

import math

ENOUGH = 1e-15
MOST_TERMS = 10_000
TINY = 1e-300


def two_sided(t: float, dof: float) -> float:
    """Probability that Student's t with ``dof`` (above 0) degrees is further from 0 than ``t``."""
    if math.isnan(t):
        return math.nan
    if math.isinf(t):
        return 0.0
    return regularised_beta(dof / (dof + t * t), 0.5 * dof, 0.5)


def quantile(probability: float, dof: float) -> float:
    """The ``t`` that is passed, to either side, with this probability (above 0, below 1)."""
    high = 1.0
    while two_sided(high, dof) > probability:
        high *= 2.0
    low = 0.0
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        if two_sided(middle, dof) > probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def log_survival_f(f: float, dof: float, freedom: float) -> float:
    """Natural logarithm of the probability that F with ``dof`` and ``freedom`` is past ``f``.

    Args:
        f: a mean of ``dof`` squares over a variance that was estimated.
        dof: degrees of freedom of the mean (above 0).
        freedom: those of the estimate (above 0, finite).
    """
    if not f > 0.0:
        return 0.0
    a, b = 0.5 * freedom, 0.5 * dof
    ratio = dof * f / freedom
    x = 1.0 / (1.0 + ratio)
    if x > (a + 1.0) / (a + b + 2.0):
        return math.log1p(-regularised_beta(ratio * x, b, a))
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    # The power as a logarithm: far out it is smaller than any number.
    front += a * math.log(x) + b * (math.log(ratio) + math.log(x))
    return front + math.log(_fraction(x, a, b) / a)


def regularised_beta(x: float, a: float, b: float) -> float:
    """``I_x(a, b)``, the share of the beta distribution that is below ``x`` in 0 ... 1."""
    if x <= 0.0 or x >= 1.0:
        return 0.0 if x <= 0.0 else 1.0
    if x > (a + 1.0) / (a + b + 2.0):  # where the fraction converges slowly
        return 1.0 - regularised_beta(1.0 - x, b, a)
    front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front += a * math.log(x) + b * math.log1p(-x)
    return math.exp(front) * _fraction(x, a, b) / a


def _fraction(x: float, a: float, b: float) -> float:
    """``1 / (1 + d_1 / (1 + d_2 / ...))``, DLMF 8.17.22."""
    c, d = 1.0, _away(1.0 - (a + b) * x / (a + 1.0))
    d = 1.0 / d
    h = d
    for m in range(1, MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        for term in (even, odd):
            d = 1.0 / _away(1.0 + term * d)
            c = _away(1.0 + term / c)
            h *= c * d
        if abs(c * d - 1.0) < ENOUGH:
            break
    return h


def _away(x: float) -> float:
    """Not zero."""
    return x if abs(x) > TINY else TINY
