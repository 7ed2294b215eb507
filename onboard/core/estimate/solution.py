"""From sums to numbers: estimate, honest covariance, held-out residuals.

Whitened innovations are independent only as far as the noise model is right.  Residuals of real
flights are correlated, so the inverse of the sums alone is optimistic.  By how much is told by how
blocks of the flight contradict each other, and it differs from direction to direction
(:mod:`~onboard.core.estimate.scatter`): the data weigh less along those that contradict themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from onboard.core.estimate.limits import (
    CONTRADICTION,
    FEWEST_BLOCKS,
    FOLDS,
    GRAM_DOUBT,
    MATTERS,
    MOST_NOISE,
    ONE_IN_A_THOUSAND,
)
from onboard.core.estimate.scatter import Scatter
from onboard.core.estimate.weighing import Weighing, directions_of
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, total
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model


@dataclass(frozen=True, slots=True)
class Solution:
    """Estimate of all unknowns of a model.

    Attributes:
        theta: (m,) estimate with the prior.
        covariance: (m, m) of it, inflated for correlated residuals.
        information: (m, m) of the data alone, inflated likewise.
        variance_inflation: factor on the variance of the six, or of the sum of them that blocks
            contradict each other about most, at least 1.
        contradicts: whether blocks ask for different parameters.
        nis: mean normalised innovation squared at ``theta``; 1 if the noise model is right.
        rows: number of whitened innovations behind it.
    """

    theta: Array
    covariance: Array
    information: Array
    variance_inflation: float
    contradicts: bool
    nis: float
    rows: float


def share_of_gram(sums: NormalSums, prior_information: Array) -> float:
    """Of the noise Gram, so that what is left stays positive definite."""
    G = sums.G
    if not np.any(G):
        return 1.0
    A = sums.N + prior_information
    if _positive(MOST_NOISE * A - G):  # which nearly all are, and that is soon seen
        return 1.0
    # Largest share of any direction that the noise claims.
    L = np.linalg.cholesky(A)
    scaled = np.linalg.solve(L, np.linalg.solve(L, G).T)
    share = float(np.linalg.eigvalsh((scaled + scaled.T) / 2).max())
    return 1.0 if share <= MOST_NOISE else MOST_NOISE / share


def _positive(A: Array) -> bool:
    """Whether a symmetric matrix has no direction in which it is zero or less."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        return False
    return True


def solve(blocks: Sequence[Block], model: Model) -> Solution:
    """Maximum a posteriori estimate with a covariance that the residuals confirm."""
    sums = total(blocks)
    prior_information = 1.0 / model.prior_sigma**2
    prior = np.diag(prior_information)
    share = share_of_gram(sums, prior)
    G = share * sums.G
    D = sums.N - G
    inverse = np.asarray(np.linalg.inv(D + prior), dtype=np.float64)
    theta = inverse @ (sums.b + prior_information * model.prior)
    nis = sums.residual(theta) / max(sums.rows, 1.0)
    X, strength = directions_of(D, prior_information)
    V = np.eye(model.size) * max(1.0, nis)
    bare: Callable[[], Array] = V.copy
    if len(blocks) >= FEWEST_BLOCKS:
        scatter = Scatter.of(blocks, theta, inverse, share)
        pool = scatter.pool(prior_information, max(1.0, nis))
        V = scatter.noise(X, strength, pool)
        bare = partial(scatter.noise, X, strength, pool, widened=False)
    weighing = Weighing(X, strength, V)
    theta = model.prior + weighing.estimate(sums.b - D @ model.prior)
    # Sandwich: the innovations carry D + G of information, of which G is not signal.
    doubt = weighing.weights * (X.T @ (GRAM_DOUBT * G * theta)).T
    noise = weighing.noise(D + G) + doubt.T @ doubt
    back = weighing.information[:, None] * (X.T * prior_information)  # of X, its inverse
    information = back.T @ np.linalg.pinv(noise, hermitian=True) @ back
    covariance = weighing.covariance(noise)
    plain = (X / (np.maximum(strength, 0.0) + 1.0)) @ X.T
    six = model.slices.get("six", slice(None))

    def inflation(by: Weighing) -> float:
        return _largest_ratio(by.covariance(by.noise(D))[six, six], plain[six, six])

    inflated = inflation(weighing)
    # That little is known of the noise makes sigmas wider, and is no contradiction.
    contradicts = inflated > CONTRADICTION and (
        inflation(Weighing(X, strength, bare())) > CONTRADICTION
    )
    return Solution(
        theta,
        covariance,
        (information + information.T) / 2,
        inflated,
        contradicts,
        nis,
        sums.rows,
    )


def without(sums: NormalSums, part: NormalSums, model: Model) -> NormalSums:
    """Sums of a flight less those of a part of it, with something left in every direction.

    Args:
        sums: of the flight.
        part: of it.
        model: of the sums, with its prior.
    """
    rest = sums - part
    # Noise that leaves enough of all of a flight may leave nothing of four fifths of it.
    rest.G *= share_of_gram(rest, np.diag(model.prior_sigma**-2.0))
    return rest


def limited(blocks: list[Block], model: Model) -> list[Block]:
    """Blocks whose noise in the regressors leaves something in every direction of the flight."""
    if not blocks:
        return blocks
    share = share_of_gram(total(blocks), np.diag(model.prior_sigma**-2.0))
    if share >= 1.0:
        return blocks
    out = []
    for block in blocks:
        sums = block.sums
        sums.G *= share
        out.append(Block(block.start, block.end, sums))
    return out


def noise_matters(blocks: Sequence[Block], model: Model, index: list[int]) -> bool:
    """Whether noise in the regressors moves one of the six by more than answers may differ.

    Args:
        blocks: of the flight.
        model: of the sums.
        index: unknowns that are fitted, with the six first.
    """
    sums = total(blocks).subset(index)
    if not np.any(sums.G):
        return False
    information = model.prior_sigma[index] ** -2.0
    covariance = np.linalg.inv(sums.N + np.diag(information))
    theta = covariance @ (sums.b + model.prior[index] * information)
    moved = np.abs(covariance @ (sums.G @ theta))[:6]
    return bool(np.any(moved > MATTERS * np.sqrt(np.diag(covariance)[:6])))


def _largest_ratio(a: Array, b: Array) -> float:
    """The largest ratio of the variances of any sum by two covariances."""
    root = np.linalg.inv(np.linalg.cholesky(b))
    return float(np.linalg.eigvalsh(root @ a @ root.T).max())


def by_chance(n: Array) -> Array:
    """What a mean of ``n`` squares of unit normals exceeds once in a thousand times.

    Source: Wilson and Hilferty (1931), the cube root of chi-square is nearly normal.
    """
    spread = 2.0 / (9.0 * n)
    out: Array = (1.0 - spread + ONE_IN_A_THOUSAND * np.sqrt(spread)) ** 3
    return out


def held_out(blocks: Sequence[Block], model: Model, fixed: dict[int, float] | None = None) -> float:
    """Root mean square whitened residual on blocks that the fit did not see.

    Args:
        blocks: in order of time.
        model: with its prior.
        fixed: unknowns held at a value instead of fitted (the parameters in force).

    Returns:
        Dimensionless; NaN with fewer than two blocks.
    """
    if len(blocks) < 2:
        return float("nan")
    everything = total(blocks)
    prior = np.diag(1.0 / model.prior_sigma**2)
    free = [i for i in range(model.size) if not fixed or i not in fixed]
    held = np.zeros(model.size)
    for i, value in (fixed or {}).items():
        held[i] = value
    square, rows = 0.0, 0.0
    for fold in np.array_split(np.arange(len(blocks)), min(FOLDS, len(blocks))):
        out = total([blocks[i] for i in fold])
        rest = without(everything, out, model)
        theta = held.copy()
        A = (rest.signal + prior)[np.ix_(free, free)]
        c = rest.b + prior @ model.prior - (rest.N @ held)
        theta[free] = np.linalg.solve(A, c[free])
        square += out.residual(theta)
        rows += out.rows
    return float(np.sqrt(max(square, 0.0) / max(rows, 1.0)))


def fitted_rms(
    blocks: Sequence[Block], model: Model, fixed: dict[int, float] | None = None
) -> float:
    """Root mean square whitened residual of the fit itself, some unknowns held if wanted."""
    sums = total(blocks)
    prior = np.diag(1.0 / model.prior_sigma**2)
    free = [i for i in range(model.size) if not fixed or i not in fixed]
    theta = np.zeros(model.size)
    for i, value in (fixed or {}).items():
        theta[i] = value
    A = (sums.signal + prior)[np.ix_(free, free)]
    c = sums.b + prior @ model.prior - sums.N @ theta
    theta[free] = np.linalg.solve(A, c[free])
    return float(np.sqrt(max(sums.residual(theta), 0.0) / max(sums.rows, 1.0)))
