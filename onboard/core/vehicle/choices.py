"""Solutions with some of the effects free: algebra on the sums of one fit with all of them in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.half_space import least_above
from onboard.core.vehicle.block_sums import total
from onboard.core.vehicle.bordered import Bordered
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.inflation import inflated
from onboard.core.vehicle.limits import APART, FOLDS, SURE


@dataclass(frozen=True, slots=True)
class Solved:
    """A choice of effects: unknowns about the full fit's, and what is left.

    Attributes:
        x: (m,) difference of the unknowns from those of the full fit.
        sigma: (m,) of the free ones, inflated; zero for those that are fixed.
        chi2: whitened squares and prior, over the inflation.
        covariance: (m, m) of the free ones, inflated and with what no data tell; zero elsewhere.
    """

    x: Array
    sigma: Array
    chi2: float
    covariance: Array

    def apart(self, places: Sequence[int], off: Array) -> float:
        """Squared distance of some unknowns that are ``off`` (p,), in sigmas."""
        inside = self.covariance[np.ix_(list(places), list(places))]
        return float(off @ np.linalg.solve(inside, off))


class Choices:
    """Solutions with any subset of the effects free, the others nominal."""

    def __init__(self, fit: Fit) -> None:
        """Take the sums of a fit."""
        self.fit = fit
        self._N, self._b, self._s = total(fit.blocks, len(fit.theta))
        self._nominal = fit.model.nominal_near(fit.theta) - fit.theta
        self.folds = _folds(len(fit.blocks))

    @property
    def names(self) -> tuple[str, ...]:
        """Effects in the model."""
        return tuple(dict.fromkeys(e.name for e in self.fit.model.effects if e.name))

    @property
    def told(self) -> Solved:
        """With everything free: the numbers that are told."""
        f = self.fit
        every = list(range(len(f.theta)))
        inside = f.covariance + f.untold(f.information, every)
        return Solved(np.zeros(len(f.theta)), f.sigma, self._s / f.scale, inside)

    def solved(self, effects: Sequence[str]) -> Solved:
        """With these effects free."""
        x, free = self._at(effects, self._N, self._b)
        f = self.fit
        apart = x - self._nominal
        squares = self._s - 2.0 * self._b @ x + x @ self._N @ x + f.prior @ (apart * apart)
        information = (self._N + np.diag(f.prior))[np.ix_(free, free)]
        sigma, covariance = np.zeros(len(x)), np.zeros((len(x),) * 2)
        inside = inflated(information, f.prior[free], f.inflation[free])
        inside += f.untold(information, free)
        covariance[np.ix_(free, free)] = inside
        for i, s in zip(free, np.sqrt(np.diag(inside)).tolist(), strict=True):
            sigma[i] = f.model.unknowns[i].doubted(float(f.theta[i] + x[i]), s)
        return Solved(x, sigma, float(squares) / f.scale, covariance)

    def held_out(self, effects: Sequence[str]) -> float:
        """Whitened squares of every fold, each by unknowns of the others; over the inflation."""
        squares = 0.0
        for fold, x in self.by_fold(effects):
            N, b, s = self._total(fold)
            squares += s - 2.0 * float(b @ x) + float(x @ N @ x)
        return squares / self.fit.scale

    def by_fold(self, effects: Sequence[str]) -> list[tuple[list[int], Array]]:
        """Blocks of each fold, and (m,) unknowns about the fit's by all other blocks."""
        out = []
        for fold in self.folds:
            N, b, _ = self._total(fold)
            x, _ = self._at(effects, self._N - N, self._b - b)
            out.append((fold, x))
        return out

    def lasting(self, effects: Sequence[str], places: Sequence[int], whole: Solved) -> bool:
        """Whether one of these unknowns (places) is off also without any two blocks in a row.

        What is of the vehicle is there all the time, what is of the air for a while (a gust front)
        is not.  A witness against it is flight that does not show the difference, and that the two
        blocks contradict: that a part of a flight shows it less surely than all of it is no news.
        By how much two blocks move a number by chance is the difference of the variances without
        them and with them (J. A. Hausman, *Econometrica* 46, 1978).

        Args:
            effects: that are free.
            places: of the unknowns that are asked about.
            whole: by all blocks.
        """
        f, blocks = self.fit, self.fit.blocks
        lasts = set(places)
        free = np.array(self._free(effects))
        fixed = self._fixed(free)
        rest = (self._b - self._N @ fixed + f.prior * (self._nominal - fixed))[free]
        information = (self._N + np.diag(f.prior))[np.ix_(free, free)]
        by_all = dict(zip(free.tolist(), np.diag(np.linalg.inv(information)), strict=True))
        bound = (f.model.least - f.theta)[free]
        system = Bordered.of(information, rest, self._own(free, bound, places))
        for i in range(len(blocks) - 1):
            # What other flights have to themselves does not change with these blocks.
            at, N, b = system.keeping({blocks[i].part, blocks[i + 1].part})
            its = free[at]
            for block in blocks[i : i + 2]:
                gone = replace(block, b=block.b - block.times(fixed))
                less_N, less_b = gone.of(its)
                N, b = N - less_N, b - less_b
            x = dict(zip(its.tolist(), least_above(N, b, bound[at]).tolist(), strict=True))
            variance = dict(zip(its.tolist(), np.diag(np.linalg.inv(N)), strict=True))
            for k in tuple(lasts):
                unknown, root = f.model.unknowns[k], math.sqrt(f.inflation[k])
                apart = abs(f.theta[k] + x[k] - unknown.nominal)
                moved = abs(whole.x[k] - x[k])
                chance = root * math.sqrt(max(variance[k] - by_all[k], 0.0))
                sigma = root * math.sqrt(variance[k])
                if moved > APART * chance and apart < unknown.floor + SURE * sigma:
                    lasts.discard(k)
        return bool(lasts)

    def _total(self, fold: Sequence[int]) -> tuple[Array, Array, float]:
        """Sums of some blocks."""
        return total([self.fit.blocks[i] for i in fold], len(self.fit.theta))

    def _own(
        self, free: NDArray[np.intp], bound: Array, asked: Sequence[int]
    ) -> dict[int, NDArray[np.intp]]:
        """Places among the free of what each flight has to itself and nothing asks or bounds."""
        acting = {block.part: block.places for block in self.fit.blocks}
        flights = sum(np.isin(free, places).astype(int) for places in acting.values())
        able = np.isneginf(bound) & ~np.isin(free, asked) & (flights == 1) & (len(acting) > 1)
        return {
            part: np.flatnonzero(able & np.isin(free, places)) for part, places in acting.items()
        }

    def _fixed(self, free: NDArray[np.intp]) -> Array:
        """(m,) unknowns about the fit's of what is not free; zero of what is."""
        x = self._nominal.copy()
        x[free] = 0.0
        return x

    def _free(self, effects: Sequence[str]) -> list[int]:
        """Places of what is free with these effects."""
        return sorted({i for n in (*effects, "") for i in self.fit.model.indices(n)})

    def _at(self, effects: Sequence[str], N: Array, b: Array) -> tuple[Array, list[int]]:
        """Unknowns about the fit's by these sums, and which of them are free."""
        f = self.fit
        free = self._free(effects)
        x = self._fixed(np.array(free))
        full_N, full_b = N + np.diag(f.prior), b + f.prior * self._nominal
        rest = full_b - full_N @ x
        bound = (f.model.least - f.theta)[free]
        x[free] = least_above(full_N[np.ix_(free, free)], rest[free], bound)
        return x, free


def _folds(blocks: int) -> list[list[int]]:
    """Blocks dealt to folds in turn, neighbours apart."""
    count = min(FOLDS, blocks)
    return [list(range(k, blocks, count)) for k in range(count)] if count > 1 else []
