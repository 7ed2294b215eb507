"""The chi-square distribution's tail, for any number of degrees of freedom.

Sources: NIST Digital Library of Mathematical Functions, 8.11.4 (the series) and 8.9.2 (the
continued fraction) of the incomplete gamma functions; Lentz's way to evaluate the fraction.
"""

from __future__ import annotations

import math

CHI_SQUARE_999 = (0.0, 10.83, 13.82, 16.27, 18.47, 20.52, 22.46)
"""0.999 quantiles for 0 ... 6 degrees of freedom."""
ENOUGH = 1e-15
MOST_TERMS = 100_000
TINY = 1e-300


def survival(x: float, dof: int) -> float:
    """Probability that chi-square with ``dof`` (at least 1) degrees of freedom is past ``x``."""
    a, z = 0.5 * dof, 0.5 * x
    if not z > 0.0:
        return 1.0 if z <= 0.0 else float("nan")
    if z < a + 1.0:
        return 1.0 - math.exp(_log_front(a, z)) * _lower_series(a, z)
    return math.exp(log_survival(x, dof))


def log_survival(x: float, dof: int) -> float:
    """Natural logarithm of :func:`survival`, which is smaller than any number far out."""
    a, z = 0.5 * dof, 0.5 * x
    if not z >= a + 1.0:
        return math.log(survival(x, dof))
    return _log_front(a, z) + math.log(_upper_fraction(a, z))


def _log_front(a: float, z: float) -> float:
    return a * math.log(z) - z - math.lgamma(a)


def _lower_series(a: float, z: float) -> float:
    """``sum z^k / (a (a + 1) ... (a + k))``."""
    term = total = 1.0 / a
    for k in range(1, MOST_TERMS):
        term *= z / (a + k)
        total += term
        if term < ENOUGH * total:
            break
    return total


def _upper_fraction(a: float, z: float) -> float:
    """``1 / (z + 1 - a - 1 (1 - a) / (z + 3 - a - ...))``."""
    b = z + 1.0 - a
    c, d = 1.0 / TINY, 1.0 / b
    h = d
    for k in range(1, MOST_TERMS):
        factor = -k * (k - a)
        b += 2.0
        d = factor * d + b
        d = 1.0 / (d if abs(d) > TINY else TINY)
        c = b + factor / c
        c = c if abs(c) > TINY else TINY
        h *= c * d
        if abs(c * d - 1.0) < ENOUGH:
            break
    return h
