"""What commands that answer a disturbance may have done to the unknowns, for any choice of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array


@dataclass(frozen=True, slots=True)
class Answered:
    """What commands that undo all of a disturbance add to the scores.

    Where they undo the share rho of it, an estimate is off by ``rho N^-1 score``: from what least
    squares tell of the force over the command to what they tell of the command over the force
    (R. Frisch, *Statistical Confluence Analysis*, 1934).  What rho was nobody sees: anything from
    nothing to one is as likely as anything else.  No further is an estimate in doubt than it is
    from where unknowns were known to be before the flight.

    Attributes:
        score: (m,).
        prior: (m,) weights of the prior, 1 / sigma^2.
        apart: (m,) the estimate less the prior's.
    """

    score: Array
    prior: Array
    apart: Array

    def covariance(self, information: Array, free: Sequence[int]) -> Array:
        """(f, f) of the free unknowns, by answers.

        Args:
            information: (f, f) of the free ones, the prior in it.
            free: their places.
        """
        places = list(free)
        off = np.linalg.solve(information, self.score[places]) / math.sqrt(3.0)
        prior, apart = self.prior[places], self.apart[places]
        size = math.sqrt(float(off @ (prior * off)))
        most = math.sqrt(1.0 + float(apart @ (prior * apart)))
        off = off * min(1.0, most / max(size, most))
        out: Array = np.outer(off, off)
        return out
