"""What vehicles of a type share: a mean, and the scatter of the vehicles about it.

Each of k vehicles has its own true value, which scatters about that of the type with ``tau``; it is
known with a sigma of its own.  With ``w_i = 1 / sigma_i^2`` and ``Q = sum w_i (y_i - y_w)^2``,

    tau^2 = max(0, (Q - (k - 1)) / (sum w_i - sum w_i^2 / sum w_i))

(DerSimonian and Laird, *Controlled Clinical Trials* 7, 1986).  With so few vehicles ``tau`` is
hardly known, and a mean with ``v_i = 1 / (sigma_i^2 + tau^2)`` as weights claims too much: its
variance is

    max(1, sum v_i (y_i - mean)^2 / (k - 1)) / sum v_i,

compared with Student's t of ``k - 1`` degrees (Hartung and Knapp, *Statistics in Medicine* 20,
2001; Sidik and Jonkman 2002; never below the plain variance: Roever, Knapp and Friede, *BMC Medical
Research Methodology* 15, 2015).  Another vehicle of the type is expected within the mean and
``sqrt(tau^2 + sigma^2)`` times Student's t of ``k - 2`` degrees (Higgins, Thompson and
Spiegelhalter, *Journal of the Royal Statistical Society A* 172, 2009).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from onboard.core.fleet.course import variance_factor
from onboard.core.fleet.limits import FEWEST_VEHICLES
from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.maths.student import two_sided


@dataclass(frozen=True, slots=True)
class Shared:
    """A random-effects mean.

    Attributes:
        mean: of the type.
        sigma: of the mean; to be read with Student's t of ``count - 1`` degrees.
        between: scatter of the vehicles beyond their own sigmas.
        next_sigma: of another vehicle of the type about the mean.
        p_value: probability of a mean so far from nothing by chance.
        scatter_p_value: of so much scatter if the vehicles were all alike.
        count: vehicles.
    """

    mean: float
    sigma: float
    between: float
    next_sigma: float
    p_value: float
    scatter_p_value: float
    count: int


def pooled(value: Array, sigma: Array) -> tuple[float, float]:
    """Mean of one vehicle's flights (n,) and its sigma, with their scatter where it is larger."""
    w = 1.0 / sigma**2
    mean = float((w @ value) / w.sum())
    return mean, math.sqrt(variance_factor(float(w @ (value - mean) ** 2), len(w) - 1) / w.sum())


def shared(value: Array, sigma: Array, common: float = 0.0) -> Shared | None:
    """What vehicles share; None if they are fewer than three.

    Args:
        value: (k,) one for each vehicle, in one unit.
        sigma: (k,) of them, above 0.
        common: sigma of what is wrong with all of them alike, and is no less in their mean.
    """
    k = len(value)
    if k < FEWEST_VEHICLES:
        return None
    w = 1.0 / sigma**2
    Q = float(w @ (value - (w @ value) / w.sum()) ** 2)
    square = max(0.0, (Q - (k - 1)) / float(w.sum() - (w @ w) / w.sum()))
    v = 1.0 / (sigma**2 + square)
    mean = float((v @ value) / v.sum())
    scatter = float(v @ (value - mean) ** 2) / (k - 1)
    of_mean = math.sqrt(max(1.0, scatter) / float(v.sum()) + common**2)
    return Shared(
        mean=mean,
        sigma=of_mean,
        between=math.sqrt(square),
        next_sigma=math.sqrt(square + of_mean**2),
        p_value=two_sided(abs(mean) / of_mean, k - 1),
        scatter_p_value=survival(Q, k - 1),
        count=k,
    )
