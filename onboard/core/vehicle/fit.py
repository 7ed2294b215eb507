"""Unknowns of a model by Gauss-Newton on whitened residuals, and the sums that are left of it.

All inference after the fit (other choices of effects, held-out residuals, scatter between blocks)
is algebra on the blocks' sums about the estimate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.half_space import least_above
from onboard.core.vehicle.answered import Answered
from onboard.core.vehicle.block_sums import BlockSums, total
from onboard.core.vehicle.columns import Columns
from onboard.core.vehicle.inflation import inflated, inflation_of
from onboard.core.vehicle.instruments import whitened_regressors, whitened_residual
from onboard.core.vehicle.limits import (
    LEAST_SHARE,
    MORE_ROUNDS,
    NOISE_ROUNDS,
    ROUNDS,
    SETTLED,
    SHRINKING,
    STALE,
)
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.motion_errors import scores_of
from onboard.core.vehicle.noise import AxisNoise, fitted_noise
from onboard.core.vehicle.turned import Turned
from onboard.core.vehicle.windows import windows_of


@dataclass(frozen=True, slots=True)
class Fit:
    """A model with its unknowns found.

    Attributes:
        model: what was fitted.
        theta: (m,) unknowns.
        prior: (m,) weights of the prior, 1 / sigma^2.
        blocks: sums about ``theta``.
        inflation: (m,) by how much variances by whitened rows exceed what these promise.
        noise: by axis.
        residual: (n, k) measured less predicted, m/s^2.
        jacobian: (n, k) of the prediction.
        sensitivity: (n, k) to gusts, 1/s.
        block: (n,) number of the block of each step.
        doubt: (m,) by how much laws may be wrong in the unknowns.
        considered: (m, l) what each error of the recorded motion adds to the scores.
        scale: one inflation for tests of several unknowns: that of the blocks' scores.
        turned: what gusts may have done to the unknowns; None where none are seen.
        answered: what commands that answer a disturbance may have; None where there are none.
    """

    model: ForceModel
    theta: Array
    prior: Array
    blocks: tuple[BlockSums, ...]
    inflation: Array
    noise: tuple[AxisNoise, ...]
    residual: Array
    jacobian: Columns
    sensitivity: Array
    block: NDArray[np.int64]
    doubt: Array
    considered: Array
    scale: float
    turned: Turned | None = None
    answered: Answered | None = None

    @property
    def information(self) -> Array:
        """(m, m) of all blocks and the prior."""
        return total(self.blocks, len(self.prior))[0] + np.diag(self.prior)

    @property
    def covariance(self) -> Array:
        """(m, m), inflated."""
        return inflated(self.information, self.prior, self.inflation)

    @property
    def sigma(self) -> Array:
        """(m,) standard deviations, with what the laws are good for."""
        every = list(range(len(self.theta)))
        untold = self.untold(self.information, every)
        plain = np.sqrt(np.diag(self.covariance + untold))
        pairs = zip(self.model.unknowns, self.theta.tolist(), plain.tolist(), strict=True)
        return np.array([u.doubted(v, s) for u, v, s in pairs])

    def untold(self, information: Array, free: Sequence[int]) -> Array:
        """(f, f) covariance that no data tell: of laws, and by what regressors may be bent by.

        Args:
            information: (f, f) of the free ones, the prior in it.
            free: their places.
        """
        out: Array = np.diag(self.doubt[list(free)] ** 2)
        for may_have in (self.turned, self.answered):
            if may_have is not None:
                out += may_have.covariance(information, free)
        return out


@dataclass(frozen=True, slots=True)
class Slopes:
    """Derivatives (n, k) of a prediction, and without a tilt; None where that is not needed."""

    by: Columns
    level: Columns | None


def slopes_at(model: ForceModel, theta: Array) -> Slopes:
    """Those of a model at its unknowns (m,)."""
    return Slopes(model.jacobian(theta), _level(model, theta))


def fitted(
    model: ForceModel, start: Array | None = None, noise: Sequence[AxisNoise] | None = None
) -> Fit:
    """Find unknowns and noise in turn.

    Args:
        model: to be fitted; all its unknowns are free, each within its prior.
        start: (m,) where to begin; the nominal airframe if None.
        noise: of a fit that has come to the start; it is found once more, and not from nothing.
    """
    theta = model.nominal if start is None else start.copy()
    prior = 1.0 / model.plausible**2
    turns = NOISE_ROUNDS if noise is None else 1
    sensitivity = np.ones((len(model.flight), len(model.axes)))
    if noise is None:
        noise = tuple(AxisNoise(0.3) for _ in model.axes)
    else:
        sensitivity = model.sensitivity(theta)
    windows = windows_of(model.flight)
    for turn in range(turns):
        theta = _settled(model, theta, prior, noise, sensitivity)
        residual = model.measured() - model.predicted(theta)
        sensitivity = model.sensitivity(theta)
        noise = tuple(
            fitted_noise(
                windows.mean(residual[:, k]),
                windows.mean(sensitivity[:, k]),
                windows.piece,
                windows.length_s,
                gusts=turn == turns - 1,
            )
            for k in range(len(model.axes))
        )
    theta = _settled(model, theta, prior, noise, sensitivity)
    return summed(model, theta, prior, noise, sensitivity)


def summed(
    model: ForceModel,
    theta: Array,
    prior: Array,
    noise: Sequence[AxisNoise],
    sensitivity: Array,
    slopes: Slopes | None = None,
) -> Fit:
    """Sums by block about ``theta`` (m,), and what their scatter says of the variances.

    ``slopes`` are those at ``theta``, where they are known.
    """
    residual = model.measured() - model.predicted(theta)
    slopes = slopes_at(model, theta) if slopes is None else slopes
    jacobian, level = slopes.by, slopes.level
    windows = windows_of(model.flight)
    of_row = model.flight.blocks_of(model.flight.t[windows.first])
    # A step is of the block that its row is counted in, wherever the next one begins.
    block = np.repeat(of_row, windows.counts)
    left = whitened_residual(model, residual, noise, sensitivity)
    by = whitened_regressors(model, jacobian, noise, sensitivity, level)
    considered = scores_of(model, theta, by, noise, sensitivity)
    part = model.flight.part[windows.first]
    sums = []
    for number in np.unique(of_row):
        mine = of_row == number
        y = np.concatenate([axis[mine] for axis in left])
        h = np.concatenate([columns.by[mine] for columns in by])
        its = int(part[mine][0])
        sums.append(BlockSums(h.T @ h, h.T @ y, float(y @ y), len(y), jacobian.places[its], its))
    inflation, scale = inflation_of(sums, prior, theta <= model.least, considered)
    return Fit(
        model,
        theta,
        prior,
        tuple(sums),
        inflation,
        tuple(noise),
        residual,
        jacobian,
        sensitivity,
        block,
        np.zeros(len(theta)),
        considered,
        scale,
    )


def _settled(
    model: ForceModel, theta: Array, prior: Array, noise: Sequence[AxisNoise], sensitivity: Array
) -> Array:
    """Gauss-Newton steps, halved where they lead uphill."""
    measured, nominal = model.measured(), model.nominal

    def left(at: Array) -> list[Array]:
        return whitened_residual(model, measured - model.predicted(at), noise, sensitivity)

    def cost(at: Array) -> float:
        apart = at - nominal
        return float(sum(y @ y for y in left(at)) + prior @ (apart * apart))

    def regressors(at: Array) -> list[Columns]:
        level = _level(model, at)
        return whitened_regressors(model, model.steps(at), noise, sensitivity, level)

    now = cost(theta)
    at, by = theta, regressors(theta)
    share, before = 1.0, math.inf
    for _ in range(MORE_ROUNDS if model.instrumented else ROUNDS):
        if np.max(np.abs(theta - at) / model.plausible) > STALE:
            at, by = theta, regressors(theta)
        N, b = np.diag(prior), prior * (nominal - theta)
        for columns, y in zip(by, left(theta), strict=True):
            more_N, more_b = columns.normal(y)
            N, b = N + more_N, b + more_b
        step = least_above(N, b, model.least - theta)
        sigma = np.sqrt(np.diag(np.linalg.inv(N)))
        size = float(np.max(np.abs(step) / sigma))
        if model.instrumented:
            # Regressors that are told from the past lead to no minimum of these squares, and where
            # they lead to and fro it is half the way.
            share = 0.5 * share if size > SHRINKING * before else share
            theta, before = theta + share * step, size
            if size < SETTLED or share < LEAST_SHARE:
                break
            continue
        for _halving in range(6):
            trial = theta + step
            then = cost(trial)
            if then <= now + 1e-6:
                theta, now = trial, then
                break
            step = 0.5 * step
        else:
            break
        if np.max(np.abs(step) / sigma) < SETTLED:
            break
    return theta


def _level(model: ForceModel, theta: Array) -> Columns | None:
    """(n, k) derivatives without a tilt; None where they are not needed."""
    return model.levelled.steps(theta) if model.instrumented else None
