"""How the linearisation goes where solutions about it ask for, pass by pass.

Solutions about two points are compared by what they ask for, never by their likelihoods: the
recorded attitude is read at the instants that a latency makes of the receiver's stamps, and at 10
samples a second that is other data about each point, likelier by hundreds midway between two
samples than at one.  So the way is that of a root: go to what is asked for; a step that turns back
on the one before has gone too far, and less of it is made from there on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.limits import LEAST_OF_A_STEP, NOT_WORTH, WIDER_STEPS
from onboard.core.estimate.solution import Solution
from onboard.core.maths.arrays import Array
from onboard.core.model.linearisation import MOVING, Linearisation
from onboard.core.model.regressors import Model


def _sigmas(found: Solution, model: Model) -> Array:
    """(10,) standard deviations of what moves, where ``model`` is that of a solution."""
    out: Array = np.sqrt(np.diag(found.covariance))[[model.index[name] for name in MOVING]]
    return out


def worth(found: Solution, model: Model, least: Sequence[float]) -> list[float]:
    """Moves of the first of :data:`MOVING` from which on another pass is worth it.

    About a point that is a share of a sigma away a solution is off by less than half of that.

    Args:
        found: what is known.
        model: of which it is.
        least: moves that are never worth one.
    """
    sigmas = _sigmas(found, model)[: len(least)].tolist()
    return [max(a, NOT_WORTH * b) for a, b in zip(least, sigmas, strict=True)]


class Approach:
    """Where the next pass's linearisation should be.

    Attributes:
        at: there.
    """

    def __init__(self, at: Linearisation) -> None:
        """Take where it begins."""
        self.at = at
        self._share = 1.0
        self._step = np.zeros(len(MOVING))

    def go(self, asked: Linearisation, found: Solution, model: Model) -> Linearisation:
        """Go towards what a solution has asked for; where to.

        Args:
            asked: by the solution about the point before.
            found: the solution; its sigmas say how moves of one thing compare with another's.
            model: of which it is.
        """
        before = self._step
        self._step = np.subtract(asked.moving, self.at.moving) / _sigmas(found, model)
        back = float(before @ self._step) < 0.0
        share = self._share / 2.0 if back else self._share * WIDER_STEPS
        self._share = float(np.clip(share, LEAST_OF_A_STEP, 1.0))
        self.at = self.at.towards(asked, self._share)
        return self.at
