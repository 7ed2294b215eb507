"""A pass with more columns than its model has, that take no part in it.

They go through the filter beside the others, and what they come out with is asked afterwards: gates
and attitude know that their unknowns are nothing, and sums and traces are of the model's own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import PassResult
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Model

NO_PART = 1e-9
"""Sigma of what takes no part, in whatever unit: no flight knows anything as well [cost]."""


class AccompaniedPass(Pass):
    """A pass of one member.

    Attributes:
        own: how many of its columns, the first ones, are the model's own.
        sums: as there, of all columns.
    """

    def __init__(
        self,
        model: Model,
        wide: Model,
        point: Linearisation,
        levels: NoiseLevels,
        uses: Uses | None = None,
    ) -> None:
        """Take what a :class:`~onboard.core.filter.passes.Pass` of one member takes.

        Args:
            model: whose pass it is.
            wide: the same with more families behind its own, of sigma :data:`NO_PART`.
            point: linearisation.
            levels: of noise.
            uses: measurements to use.
        """
        self.own = model.size
        super().__init__(wide, point, (levels,), uses=uses)

    def hold(self, theta: Array, covariance: Array) -> None:
        """As there, of the model's own m unknowns."""
        wide, spread = np.zeros(self.model.size), np.zeros((self.model.size, self.model.size))
        wide[: self.own], spread[: self.own, : self.own] = theta, covariance
        super().hold(wide, spread)

    def counted(self, sums: NormalSums) -> NormalSums:
        """Those of the model's own columns."""
        return sums.subset(range(self.own))

    def process(self, segment: Segment, fixes: Fixes, trusted: NDArray[np.bool_]) -> PassResult:
        """As there; sums and traces are of the model's own unknowns."""
        result = super().process(segment, fixes, trusted)
        result.traces.keep_first(self.own)
        return result
