"""Which effects to accept: forward selection on the sums, by what holds on data not fitted.

Every question is answered by algebra on the sums of the blocks of a flight, in which all
columns were carried at once: gain in log-likelihood, gain on held-out blocks, size against
sigma, plausibility.  Whitened rows have unit variance by the noise found *with every column in the
model*; coloured residuals weaken all gains by a common factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.limits import FORGOTTEN_S
from onboard.core.estimate.limits import FOLDS
from onboard.core.estimate.solution import solve, total
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Family, Model, Unknown
from onboard.core.physics.effects.bias_step import LARGEST

OFFSETS = (3, 4, 5)
"""Columns of the offsets among the six."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A fit of some columns: unknowns (m,) with zeros for the rest, misfit, held-out misfit."""

    theta: Array
    covariance: Array
    chi2: float
    held_out: float


class Fitter:
    """Fits subsets of columns of one set of blocks."""

    def __init__(
        self,
        blocks: Sequence[Block],
        model: Model,
        variance_inflation: float,
        absent: Array | None = None,
    ) -> None:
        """Take the blocks and the factor by which their information is weakened.

        ``absent`` (m,) are the values that mean *not in the model*: zero, but for what the
        linearisation has taken in already.
        """
        self.absent = np.zeros(model.size) if absent is None else absent
        self.blocks = list(blocks)
        self.model = model
        self.variance_inflation = variance_inflation
        self.sums = total(self.blocks)
        self._prior = 1.0 / model.prior_sigma**2
        folds = np.array_split(np.arange(len(self.blocks)), min(FOLDS, len(self.blocks)))
        self._members = [fold for fold in folds if len(fold) > 0]
        self._folds = [total([self.blocks[i] for i in fold]) for fold in self._members]

    @property
    def rows(self) -> float:
        """Number of rows."""
        return self.sums.rows

    def fit(self, free: Sequence[int], held: Array | None = None, *, held_out: bool = True) -> Fit:
        """Fit the columns ``free``; the rest stays at ``held`` (default: absent).

        Without ``held_out`` its held-out misfit is not a number: eight times cheaper.
        """
        at = (self.absent if held is None else held).copy()
        theta, A = self._solve(self.sums, free, at)
        chi2 = self._penalised(self.sums, theta, free)
        out = 0.0 if held_out else float("nan")
        if held_out and len(self._folds) > 1:
            for fold in self._folds:
                other, _ = self._solve(self.sums - fold, free, at)
                out += fold.residual(other)
        covariance = np.zeros_like(self.sums.N)
        covariance[np.ix_(free, free)] = np.linalg.inv(A) * self.variance_inflation
        return Fit(theta, covariance, chi2, out)

    def held_fits(
        self, free: Sequence[int], held: Array | None = None
    ) -> list[tuple[NDArray[np.intp], Array]]:
        """Blocks of each fold, and the unknowns (m,) of a fit that has not seen them."""
        at = (self.absent if held is None else held).copy()
        pairs = zip(self._members, self._folds, strict=True) if len(self._folds) > 1 else ()
        return [(members, self._solve(self.sums - fold, free, at)[0]) for members, fold in pairs]

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
        return (before.chi2 - after.chi2) / self.variance_inflation

    def variance_inflation_of(self, free: Sequence[int]) -> float:
        """How much blocks contradict each other in a model of ``free``, whole families each."""
        within, slices = set(free), self.model.slices
        columns = {
            f.name: range(*slices[f.name].indices(self.model.size)) for f in self.model.families
        }
        families = [f for f in self.model.families if within.issuperset(columns[f.name])]
        index = [i for f in families for i in columns[f.name]]
        at = self.absent.copy()
        at[index] = 0.0
        blocks = [Block(p.start, p.end, p.sums.shifted(at).subset(index)) for p in self.blocks]
        return solve(blocks, Model(families)).variance_inflation

    def held_gain(self, before: Fit, after: Fit) -> float:
        """Fall of held-out chi-square, weakened."""
        return (before.held_out - after.held_out) / self.variance_inflation

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

    def stepped(self, boundary: int) -> Fitter:
        """The same with three more columns at the end: offsets that jump at a block's start.

        The jump is the offset's own columns in the blocks from ``boundary`` on; the filter's
        memory blurs that by some seconds, which is enough to know where to look closer.
        """
        m = self.model.size
        unknowns = tuple(Unknown(f"jump_{a}", "m/s^2", 0.0, LARGEST) for a in "xyz")
        model = Model([*self.model.families, _Jump(unknowns)])
        after = [*range(m), *OFFSETS]
        blocks = []
        for i, p in enumerate(self.blocks):
            sums = NormalSums.zeros(m + 3)
            sums.s, sums.rows, sums.log_det = p.sums.s, p.sums.rows, p.sums.log_det
            sums.G[:m, :m] = p.sums.G
            if i >= boundary:
                sums.N[:] = p.sums.N[np.ix_(after, after)]
                sums.b[:] = p.sums.b[after]
            else:
                sums.N[:m, :m], sums.b[:m] = p.sums.N, p.sums.b
            blocks.append(Block(p.start, p.end, sums))
        return Fitter(
            blocks, model, self.variance_inflation, np.concatenate([self.absent, np.zeros(3)])
        )

    def jumps(self, free: Sequence[int]) -> list[tuple[int, float]]:
        """Blocks at whose start a jump of the offsets would help: (block, gain).

        Not while an EKF that has just begun converges: its attitude jumps then.
        """
        index, offsets = list(free), list(OFFSETS)
        information = np.concatenate([self._prior[index], np.full(3, LARGEST**-2)])
        prior = np.diag(information)
        mean = np.concatenate([self.model.prior[index], np.zeros(3)])
        at = self.absent.copy()
        at[index] = 0.0
        base = self.fit(index, held_out=False)
        shifted, after = self.sums.shifted(at), None
        settled = self.blocks[0].start + FORGOTTEN_S
        out = []
        for i in range(len(self.blocks) - 1, 0, -1):
            p = self.blocks[i].sums.shifted(at)
            after = p if after is None else after + p
            if self.blocks[i].start < settled:
                continue
            N = np.block(
                [
                    [
                        (shifted.N - shifted.G)[np.ix_(index, index)],
                        after.N[np.ix_(index, offsets)],
                    ],
                    [after.N[np.ix_(offsets, index)], after.N[np.ix_(offsets, offsets)]],
                ]
            )
            b = np.concatenate([shifted.b[index], after.b[offsets]])
            theta = np.linalg.solve(N + prior, b + prior @ mean)
            off = theta - mean
            N[: len(index), : len(index)] += shifted.G[np.ix_(index, index)]
            chi2 = shifted.s - 2 * theta @ b + theta @ N @ theta + off @ prior @ off
            out.append((i, float(base.chi2 - chi2) / self.variance_inflation))
        return out


class _Jump(Family):
    """Names for the columns of :meth:`Fitter.stepped`; nothing is evaluated."""

    name = "jump"

    def __init__(self, unknowns: tuple[Unknown, ...]) -> None:
        self.unknowns = unknowns
