"""Which effects to accept: forward selection on the sums, by what holds on data not fitted.

Every question is answered by algebra on the sums of the portions of a flight, in which all
columns were carried at once: gain in log-likelihood, gain on held-out portions, size against
sigma, plausibility.  Whitened rows have unit variance by the noise found *with every column in the
model*; coloured residuals weaken all gains by a common factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from onboard.core.columns import Model
from onboard.core.passes import Portion
from onboard.core.solution import FOLDS, total
from onboard.core.sums import NormalSums

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Fit:
    """A fit of some columns: unknowns (m,) with zeros for the rest, misfit, held-out misfit."""

    theta: Array
    covariance: Array
    chi2: float
    held_out: float


class Fitter:
    """Fits subsets of columns of one set of portions."""

    def __init__(
        self,
        portions: Sequence[Portion],
        model: Model,
        weaken: float,
        absent: Array | None = None,
    ) -> None:
        """Take the portions and the factor by which their information is weakened.

        ``absent`` (m,) are the values that mean *not in the model*: zero, but for what the
        linearisation has taken in already.
        """
        self.absent = np.zeros(model.size) if absent is None else absent
        self.portions = list(portions)
        self.model = model
        self.weaken = weaken
        self.sums = total(self.portions)
        self._prior = 1.0 / model.prior_sigma**2
        folds = np.array_split(np.arange(len(self.portions)), min(FOLDS, len(self.portions)))
        self._folds = [total([self.portions[i] for i in fold]) for fold in folds if len(fold) > 0]

    @property
    def rows(self) -> float:
        """Number of rows."""
        return self.sums.rows

    def fit(self, free: Sequence[int], held: Array | None = None) -> Fit:
        """Fit the columns ``free``; the rest stays at ``held`` (default: absent)."""
        at = (self.absent if held is None else held).copy()
        theta, A = self._solve(self.sums, free, at)
        chi2 = self._penalised(self.sums, theta, free)
        out = 0.0
        if len(self._folds) > 1:
            for fold in self._folds:
                other, _ = self._solve(self.sums - fold, free, at)
                out += fold.residual(other)
        covariance = np.zeros_like(self.sums.N)
        covariance[np.ix_(free, free)] = np.linalg.inv(A) * self.weaken
        return Fit(theta, covariance, chi2, out)

    def _solve(self, sums: NormalSums, free: Sequence[int], at: Array) -> tuple[Array, Array]:
        index = list(free)
        theta = at.copy()
        theta[index] = 0.0
        A = (sums.N - sums.G)[np.ix_(index, index)] + np.diag(self._prior[index])
        c = sums.b[index] - sums.N[index] @ theta + self._prior[index] * self.model.prior[index]
        theta[index] = np.linalg.solve(A, c)
        return theta, A

    def _penalised(self, sums: NormalSums, theta: Array, free: Sequence[int]) -> float:
        index = list(free)
        off = theta[index] - self.model.prior[index]
        return float(sums.residual(theta) + off @ (self._prior[index] * off))

    def gain(self, before: Fit, after: Fit) -> float:
        """Fall of chi-square, weakened."""
        return (before.chi2 - after.chi2) / self.weaken

    def held_gain(self, before: Fit, after: Fit) -> float:
        """Fall of held-out chi-square, weakened."""
        return (before.held_out - after.held_out) / self.weaken

    def rms(self, fit: Fit) -> float:
        """Whitened root mean square of a fit."""
        return float(np.sqrt(max(self.sums.residual(fit.theta), 0.0) / max(self.rows, 1.0)))

    def held_rms(self, fit: Fit) -> float:
        """Whitened root mean square on held-out portions."""
        return float(np.sqrt(max(fit.held_out, 0.0) / max(self.rows, 1.0)))


def step_times(
    fitter: Fitter, free: Sequence[int], offsets: Sequence[int]
) -> list[tuple[float, float]]:
    """Boundaries of portions at which a jump of the offsets would help: (time, gain).

    A step is the offset's own columns in the portions after it; the filter's memory blurs that
    by some seconds, which is enough to know where to look closer.
    """
    index = list(free)
    prior = np.diag(np.concatenate([fitter._prior[index], np.full(len(offsets), 0.1)]))  # noqa: SLF001 - same module
    mean = np.concatenate([fitter.model.prior[index], np.zeros(len(offsets))])
    base = fitter.fit(index)
    out = []
    after = fitter.sums
    for p, q in pairwise(fitter.portions):
        after = after - p.sums
        N = np.block(
            [
                [fitter.sums.N[np.ix_(index, index)], after.N[np.ix_(index, offsets)]],
                [after.N[np.ix_(offsets, index)], after.N[np.ix_(offsets, offsets)]],
            ]
        )
        b = np.concatenate([fitter.sums.b[index], after.b[list(offsets)]])
        theta = np.linalg.solve(N + prior, b + prior @ mean)
        off = theta - mean
        chi2 = fitter.sums.s - 2 * theta @ b + theta @ N @ theta + off @ prior @ off
        out.append((q.start, float(base.chi2 - chi2) / fitter.weaken))
    return out
