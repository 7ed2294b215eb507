"""The six given that some of them stay as they are.

The estimate is a Gaussian, mean ``x`` and covariance ``P``.  A number that the flight did not
show must not be changed, but the others were estimated *together* with it: a hovering copter
knows ``raw_z = f / scale + offset`` at one f only, so that an error of the z scale is paid for
by the z offset.  Leaving the scale at its value in force while writing the offset that
belongs to another scale would be wrong by the whole of that error.  The right companions of a
kept value ``k`` are the conditional ones,

    x_free' = x_free + P_fk P_kk^-1 (k - x_k),    P_free' = P_ff - P_fk P_kk^-1 P_kf

and how badly the flight contradicts keeping it is ``(k - x_k)^T P_kk^-1 (k - x_k)``,
chi-square with as many degrees of freedom as numbers are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CHI_SQUARE_999 = (0.0, 10.83, 13.82, 16.27, 18.47, 20.52, 22.46)
"""0.999 quantiles of chi-square for 0 ... 6 degrees of freedom."""


@dataclass(frozen=True, slots=True)
class Conditioned:
    """Six values and sigmas after some were held; a held number has sigma 0.

    ``contradiction`` is the squared Mahalanobis distance of the held values, ``limit`` its
    0.999 quantile.
    """

    values: tuple[float, ...]
    sigmas: tuple[float, ...]
    contradiction: float
    limit: float


def condition(
    estimate: Sequence[float],
    covariance: NDArray[np.float64],
    held: Sequence[bool],
    held_at: Sequence[float],
) -> Conditioned:
    """Condition the estimate (6,) with covariance (6, 6) on ``held`` numbers at ``held_at``.

    Raises:
        ValueError: the covariance is not finite, symmetric and positive definite.
    """
    x = np.asarray(estimate, dtype=np.float64)
    P = np.asarray(covariance, dtype=np.float64)
    if P.shape != (6, 6) or not np.all(np.isfinite(P)) or not np.all(np.isfinite(x)):
        raise ValueError("estimate or covariance is not finite")
    diagonal = np.diag(P)
    if np.any(diagonal <= 0.0) or not np.allclose(P, P.T, rtol=1e-6, atol=0.0):
        raise ValueError("covariance is not symmetric with a positive diagonal")
    unit = np.sqrt(diagonal)  # scales and offsets differ by orders of magnitude: normalise
    correlation = P / np.outer(unit, unit)
    if np.linalg.eigvalsh(correlation)[0] <= 0.0:
        raise ValueError("covariance is not positive definite")
    k = np.flatnonzero(np.asarray(held, dtype=bool))
    f = np.setdiff1d(np.arange(6), k)
    values = x.copy()
    sigmas = unit.copy()
    contradiction = 0.0
    if k.size:
        shift = (np.asarray(held_at, dtype=np.float64)[k] - x[k]) / unit[k]
        gain = np.linalg.solve(correlation[np.ix_(k, k)], correlation[np.ix_(k, f)]).T
        values[f] = x[f] + unit[f] * (gain @ shift)
        remaining = correlation[np.ix_(f, f)] - gain @ correlation[np.ix_(k, f)]
        sigmas[f] = unit[f] * np.sqrt(np.maximum(np.diag(remaining), 0.0))
        values[k] = np.asarray(held_at, dtype=np.float64)[k]
        sigmas[k] = 0.0
        contradiction = float(shift @ np.linalg.solve(correlation[np.ix_(k, k)], shift))
    return Conditioned(
        values=tuple(float(v) for v in values),
        sigmas=tuple(float(s) for s in sigmas),
        contradiction=contradiction,
        limit=CHI_SQUARE_999[k.size],
    )
