"""Which effects to accept: forward selection on the sums, by what holds on data not fitted.

Every question is answered by algebra on the sums of the blocks of a flight, in which all
columns were carried at once: gain in log-likelihood, gain on held-out blocks, size against
sigma, plausibility.  Whitened rows have unit variance by the noise found *with every column in
the model*.  Where blocks contradict each other, a gain is weakened by how much they do along the
columns that made it, with these in the model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.limits import FEWEST_BLOCKS, FOLDS
from onboard.core.estimate.pool import Pool
from onboard.core.estimate.scatter import Scatter, Stacked
from onboard.core.estimate.solution import without
from onboard.core.estimate.weighing import Weighing, directions_of
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, total
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model


@dataclass(frozen=True, slots=True)
class Fit:
    """A fit of the columns ``free``: all unknowns (m,), misfit, held-out misfit."""

    theta: Array
    free: tuple[int, ...]
    chi2: float
    held_out: float


@dataclass(frozen=True, slots=True)
class Gain:
    """Fall of chi-square, and what a unit of it is worth.

    Attributes:
        fall: of chi-square.
        variance: over what the sums say, along the columns that made it.
        freedom: degrees of freedom with which it is known; infinite where all the flight is judged
            by one.
    """

    fall: float
    variance: float = 1.0
    freedom: float = math.inf

    @property
    def weakened(self) -> float:
        """In units of the variance there is, no less than what the sums say."""
        return self.fall / max(self.variance, 1.0)


class Fitter:
    """Fits subsets of columns of one set of blocks."""

    def __init__(self, blocks: Sequence[Block], model: Model, absent: Array | None = None) -> None:
        """Take the blocks.

        ``absent`` (m,) are the values that mean *not in the model*: zero, but for what the
        linearisation has taken in already.
        """
        self.absent = np.zeros(model.size) if absent is None else absent
        self.blocks = list(blocks)
        self.model = model
        self.sums = total(self.blocks)
        self.prior_information = 1.0 / model.prior_sigma**2
        folds = np.array_split(np.arange(len(self.blocks)), min(FOLDS, len(self.blocks)))
        self._members = [fold for fold in folds if len(fold) > 0]
        self._folds = [total([self.blocks[i] for i in fold]) for fold in self._members]
        self._unseen = [without(self.sums, fold, model) for fold in self._folds]

    @property
    def rows(self) -> float:
        """Number of rows."""
        return self.sums.rows

    def fit(self, free: Sequence[int], held: Array | None = None, *, held_out: bool = True) -> Fit:
        """Fit the columns ``free``; the rest stays at ``held`` (default: absent).

        Without ``held_out`` its held-out misfit is not a number: eight times cheaper.
        """
        at = (self.absent if held is None else held).copy()
        theta = self._solve(self.sums, free, at)
        chi2 = self._penalised(self.sums, theta, free)
        out = 0.0 if held_out else float("nan")
        if held_out and len(self._folds) > 1:
            for fold, rest in zip(self._folds, self._unseen, strict=True):
                out += fold.residual(self._solve(rest, free, at))
        return Fit(theta, tuple(free), chi2, out)

    def held_fits(
        self, free: Sequence[int], held: Array | None = None
    ) -> list[tuple[NDArray[np.intp], Array]]:
        """Blocks of each fold, and the unknowns (m,) of a fit that has not seen them."""
        at = (self.absent if held is None else held).copy()
        pairs = zip(self._members, self._unseen, strict=True) if len(self._folds) > 1 else ()
        return [(members, self._solve(rest, free, at)) for members, rest in pairs]

    def _solve(self, sums: NormalSums, free: Sequence[int], at: Array) -> Array:
        index = list(free)
        theta = at.copy()
        theta[index] = 0.0
        A = self._information(sums, index) + np.diag(self.prior_information[index])
        c = (
            sums.b[index]
            - sums.N[index] @ theta
            + self.prior_information[index] * self.model.prior[index]
        )
        theta[index] = np.linalg.solve(A, c)
        return theta

    @staticmethod
    def _information(sums: NormalSums, index: list[int]) -> Array:
        out: Array = sums.signal[np.ix_(index, index)]
        return out

    def _penalised(self, sums: NormalSums, theta: Array, free: Sequence[int]) -> float:
        index = list(free)
        off = theta[index] - self.model.prior[index]
        return float(sums.residual(theta) + off @ (self.prior_information[index] * off))

    @staticmethod
    def gain(before: Fit, after: Fit) -> float:
        """Fall of chi-square."""
        return before.chi2 - after.chi2

    def gain_by(self, columns: Sequence[int], before: Fit, after: Fit) -> Gain:
        """The same by ``columns``, which ``after`` has, with the variance there is along them."""
        return Gain(self.gain(before, after), *self.variance_along(after, columns))

    @staticmethod
    def held_gain(before: Fit, after: Fit) -> float:
        """Fall of held-out chi-square."""
        return before.held_out - after.held_out

    def informed(self, fit: Fit, columns: Sequence[int]) -> Array:
        """(k, k) what the sums know of ``columns`` of a fit, the rest of it unknown."""
        index = list(fit.free)
        A = self._information(self.sums, index) + np.diag(self.prior_information[index])
        place = [index.index(c) for c in columns]
        out: Array = np.linalg.inv(np.linalg.inv(A)[np.ix_(place, place)])
        return out

    def moved_by(self, free: Sequence[int], columns: Sequence[int]) -> Array:
        """(f, k) by how much the unknowns ``free`` are larger with one of each of ``columns``."""
        index, by = list(free), list(columns)
        A = self._information(self.sums, index) + np.diag(self.prior_information[index])
        return np.asarray(-np.linalg.solve(A, self.sums.signal[np.ix_(index, by)]), np.float64)

    def variance_along(self, fit: Fit, columns: Sequence[int]) -> tuple[float, float]:
        """Variance over what the sums say along some columns of a fit, and its freedom."""
        if np.isinf(self.pool.freedom):
            return self.pool.variance, self.pool.freedom
        scatter = self._scatter(fit)
        place = {column: k for k, column in enumerate(fit.free)}
        back = scatter.inverse[:, [place[c] for c in columns]]
        own = back[[place[c] for c in columns]]
        # Directions in which the columns' own estimates are independent.
        X = np.linalg.solve(np.linalg.cholesky(own), back.T).T
        return self.pool.moderated(*scatter.within(X))

    def covariance(self, fit: Fit) -> Array:
        """Covariance (m, m) of a fit, as blocks confirm it; zeros for what is not free."""
        index = list(fit.free)
        information = self._information(self.sums, index)
        X, strength = directions_of(information, self.prior_information[index])
        weighing = Weighing(X, strength, self._scatter(fit).noise(X, strength, self.pool))
        out = np.zeros_like(self.sums.N)
        out[np.ix_(index, index)] = weighing.covariance(weighing.noise(information))
        return out

    @cached_property
    def pool(self) -> Pool:
        """What variance the unknowns of this flight have, with every column in the model."""
        everything = self.fit(range(self.model.size), held_out=False)
        least = max(1.0, self.sums.residual(everything.theta) / max(self.rows, 1.0))
        if len(self.blocks) < FEWEST_BLOCKS:
            return Pool(least)
        return self._scatter(everything).pool(self.prior_information, least)

    @cached_property
    def _stacked(self) -> Stacked:
        return Stacked(self.blocks)

    def _scatter(self, fit: Fit) -> Scatter:
        """Scores of the blocks about a fit, in its own columns."""
        index = list(fit.free)
        A = self._information(self.sums, index) + np.diag(self.prior_information[index])
        scores = self._stacked.scores(fit.theta)[:, index]
        inverse = np.asarray(np.linalg.inv(A), dtype=np.float64)
        return Scatter(self._stacked, scores, inverse, index)

    def rms(self, fit: Fit) -> float:
        """Whitened root mean square of a fit."""
        return float(np.sqrt(max(self.sums.residual(fit.theta), 0.0) / max(self.rows, 1.0)))

    def held_rms(self, fit: Fit) -> float:
        """Whitened root mean square on held-out blocks."""
        return float(np.sqrt(max(fit.held_out, 0.0) / max(self.rows, 1.0)))

    @property
    def log_rows(self) -> float:
        """What BIC charges for one unknown."""
        return float(np.log(max(self.rows, 2.0)))
