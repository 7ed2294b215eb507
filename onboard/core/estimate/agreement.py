"""Whether a flight agrees with what was learned before it, and would have noticed if it did not.

Identifiers do not tell two boards of one model apart, and nobody says what was done to a vehicle
while nobody looked.  So sums of before a gap are only added to those of a flight that confirms
them.  Two Gaussian answers ``m1, C1`` and ``m2, C2`` for one sensor differ by

    d = m1 - m2,    d^T (C1 + C2)^-1 d ~ chi-square with six degrees of freedom,

and are *contradicted* past its 0.999 quantile: the sums of one sensor are lost once in a thousand
flights.  Two sensors that are strangers, drawn from the prior ``P0``, differ with covariance
``2 P0 - C1 - C2``.  With ``l`` the eigenvalues of ``(C1 + C2)^-1 (2 P0 - C1 - C2)`` such a stranger
is taken for the sensor itself with the probability ``P(sum l z^2 < q)``, bounded after Chernoff by
``min_s exp(s q) prod (1 + 2 s l)^-1/2``.  While that is above one in a hundred, the flight says too
little to *confirm* anything, and what was learned waits.
"""

from __future__ import annotations

import numpy as np

from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import STRANGER
from onboard.core.estimate.saving import SavedEngine
from onboard.core.estimate.solution import Solution, solve
from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import CHI_SQUARE_999


def agrees(engine: Engine, saved: SavedEngine) -> bool | None:
    """Whether a flight and what was saved are of one sensor; None: the flight cannot tell.

    Args:
        engine: has flown since.
        saved: of before.
    """
    found = engine.solution()
    if found is None:
        return None
    if {p.sums.size for p in saved.blocks} != {engine.model.size}:
        return False
    try:
        return _agree(engine, found, saved)
    except np.linalg.LinAlgError:  # sums that no flight can have made
        return False


def _agree(engine: Engine, found: Solution, saved: SavedEngine) -> bool | None:
    then = solve(engine.brought(saved.blocks, saved.point, np.array(saved.told)), engine.model)
    apart = found.theta[:6] - then.theta[:6]
    both = found.covariance[:6, :6] + then.covariance[:6, :6]
    if float(apart @ np.linalg.solve(both, apart)) > CHI_SQUARE_999[6]:
        return False
    prior = np.diag(engine.model.prior_sigma[:6] ** 2)
    return True if passes_for_it(both, prior) < STRANGER else None


def passes_for_it(both: Array, prior: Array) -> float:
    """Bound on the probability that a stranger is not noticed.

    Args:
        both: (6, 6) sum of the covariances of the two answers.
        prior: (6, 6) covariance of what is known of any sensor.
    """
    L = np.linalg.cholesky(both)
    strange = np.linalg.solve(L, np.linalg.solve(L, 2.0 * prior - both).T)
    eigenvalues = np.maximum(np.linalg.eigvalsh((strange + strange.T) / 2), 0.0)
    s = np.geomspace(1e-4, 10.0, 200)[:, None]
    logarithm = s[:, 0] * CHI_SQUARE_999[6] - 0.5 * np.log1p(2.0 * s * eigenvalues).sum(axis=1)
    return float(np.exp(min(0.0, float(logarithm.min()))))
