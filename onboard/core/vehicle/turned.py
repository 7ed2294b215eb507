"""What gusts may have done to the unknowns, for any choice of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.limits import MOST_BY_GUSTS


@dataclass(frozen=True, slots=True)
class Turned:
    """Sums of what gusts may have made of the regressors, if the vehicle answered all of them.

    With whitened regressors H of which ``dH`` are the gusts', and their force y::

        E = sum dH^T dH,   b = sum dH^T y

    An estimate is short by ``rho (N - rho E)^-1 b``, rho the share of the gusts that the vehicle
    answered (W. A. Fuller, *Measurement Error Models*, 1987, section 1.2).  What rho was nobody
    sees.  Anything from nothing to the most being as likely as anything else, the error has a root
    mean square of the most over the square root of three; and twice that is beyond the most.
    Where gusts may have made nearly all there is, the flight tells nothing, and what is known is
    what was known before it.

    Attributes:
        E: (m, m).
        b: (m,).
        prior: (m,) weights of the prior, 1 / sigma^2.
        lean: (m, l) what each standard deviation of what was taken for known adds to the scores.
    """

    E: Array
    b: Array
    prior: Array
    lean: Array

    def covariance(self, information: Array, free: Sequence[int]) -> Array:
        """(f, f) of the free unknowns, by gusts.

        Args:
            information: (f, f) of the free ones, the prior in it.
            free: their places.
        """
        places = list(free)
        root = np.linalg.cholesky(information)
        inverse = np.linalg.inv(root)
        share, axes = np.linalg.eigh(inverse @ self.E[np.ix_(places, places)] @ inverse.T)
        before = np.sqrt(np.sum((axes.T @ root.T) ** 2 / self.prior[places], axis=1))
        short = axes.T @ inverse @ self.b[places] / np.maximum(1.0 - share, 1e-9) / math.sqrt(3.0)
        untold = (share > MOST_BY_GUSTS) | (np.abs(short) > before)
        back = inverse.T @ axes
        # One rho moves all that the flight tells; what it does not tell is free to move alone.
        moved = back[:, ~untold] @ short[~untold]
        loose = back[:, untold] * before[untold]
        leant = inverse.T @ inverse @ self.lean[places]
        out: Array = np.outer(moved, moved) + loose @ loose.T + leant @ leant.T
        return out
