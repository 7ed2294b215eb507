"""The estimate that gates and attitude follow while a pass goes on: held, or solved as it goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import EAGER_EPOCHS, LAZY_EPOCHS
from onboard.core.filter.uncertainty import Covariance, Information, Uncertainty
from onboard.core.maths.arrays import Array
from onboard.core.model.regressors import Model


class RunningEstimate:
    """Of a pass, whose compiled loops (:mod:`~onboard.core.filter.estimate_loops`) do the same.

    Attributes:
        theta: (m,) the estimate.
        uncertainty: how well it is known.
        held: whether it stays what it is.
        summed: (m + 1, m + 1) products of ``y`` (first) and ``h`` of everything, while not held.
        prior: (2, m) what is known of each unknown beforehand, and that times its mean.
        counted: (2,) epochs so far, and of them those since it was solved for.
    """

    def __init__(self, model: Model) -> None:
        """Begin with what is known before the flight."""
        m, information = model.size, 1.0 / model.prior_sigma**2
        self.theta: Array = model.prior.copy()
        self.uncertainty: Uncertainty = Covariance(np.diag(model.prior_sigma**2))
        self.held = False
        self.summed: Array = np.zeros((m + 1, m + 1))
        self.prior: Array = np.stack([information, information * model.prior])
        self.counted: NDArray[np.int64] = np.zeros(2, dtype=np.int64)

    def hold(self, theta: Array, covariance: Array) -> None:
        """Be this one (m,), (m, m) from now on."""
        self.theta, self.uncertainty, self.held = theta, Covariance(covariance), True

    def follow(self, summed: Array) -> None:
        """Go on with the sums: these products (m + 1, m + 1), and what comes."""
        self.held, self.summed, self.theta = False, summed.copy(), self.theta.copy()

    def count(self, epochs: int) -> None:
        """So many were taken while it was held."""
        self.counted += epochs

    def add(self, y: Array, h: Array) -> None:
        """Take the whitened innovations of an epoch, (r,) and (r, m), and solve now and then."""
        self.count(1)
        if self.held:
            return
        rows = np.column_stack([y, h])
        self.summed += rows.T @ rows
        epochs, since = self.counted
        if since < (1 if epochs < EAGER_EPOCHS else LAZY_EPOCHS):
            return
        self.counted[1] = 0
        known = self.summed[1:, 1:] + np.diag(self.prior[0])
        self.theta = np.linalg.solve(known, self.summed[0, 1:] + self.prior[1])
        self.uncertainty = Information(known)
