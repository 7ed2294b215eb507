"""From sums to numbers: estimate, honest covariance, held-out residuals.

Whitened innovations are independent only as far as the noise model is right.  Residuals of real
flights are correlated, so the inverse of the sums alone is optimistic.  The scatter of the score
(``b_i - N_i theta``) over blocks of the flight says by how much (cluster-robust variance, Huber
1967, White 1980; clustered by time), and the variance of the data is inflated by that factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from onboard.core.estimate.limits import (
    FEWEST_BLOCKS,
    FOLDS,
    GRAM_DOUBT,
    MOST_NOISE,
    ONE_IN_A_THOUSAND,
)
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import NormalSums
from onboard.core.model.regressors import Model


@dataclass(frozen=True, slots=True)
class Solution:
    """Estimate of all unknowns of a model.

    Attributes:
        theta: (m,) estimate with the prior.
        covariance: (m, m) of it, inflated for correlated residuals.
        information: (m, m) of the data alone, divided by the same factor.
        variance_inflation: factor on the variance of the data, at least 1.
        nis: mean normalised innovation squared at ``theta``; 1 if the noise model is right.
        rows: number of whitened innovations behind it.
    """

    theta: Array
    covariance: Array
    information: Array
    variance_inflation: float
    nis: float
    rows: float


def total(blocks: Sequence[Block]) -> NormalSums:
    """Sum over blocks (at least one)."""
    return reduce(lambda a, b: a + b, (p.sums for p in blocks))


def _limited_gram(sums: NormalSums, prior_information: Array) -> Array:
    """The noise Gram, limited so that what is left stays positive definite."""
    G = sums.G
    if not np.any(G):
        return G
    A = sums.N + prior_information
    # Largest share of any direction that the noise claims.
    L = np.linalg.cholesky(A)
    scaled = np.linalg.solve(L, np.linalg.solve(L, G).T)
    share = float(np.linalg.eigvalsh((scaled + scaled.T) / 2).max())
    return G if share <= MOST_NOISE else G * (MOST_NOISE / share)


def solve(blocks: Sequence[Block], model: Model) -> Solution:
    """Maximum a posteriori estimate with a covariance that the residuals confirm."""
    sums = total(blocks)
    prior = np.diag(1.0 / model.prior_sigma**2)
    G = _limited_gram(sums, prior)
    share = np.divide(
        np.diag(G), np.diag(sums.G), out=np.zeros(sums.size), where=np.diag(sums.G) > 0
    )
    D = sums.N - G
    theta = np.linalg.solve(D + prior, sums.b + prior @ model.prior)
    nis = sums.residual(theta) / max(sums.rows, 1.0)
    variance_inflation = max(1.0, nis, _cluster_factor(blocks, share, theta, D + prior, model))
    A = D / variance_inflation + prior
    theta = np.linalg.solve(A, sums.b / variance_inflation + prior @ model.prior)
    inverse = np.linalg.inv(A)
    # Sandwich: the innovations carry D + G of information, of which G is not signal.
    doubt = (GRAM_DOUBT * G) / variance_inflation
    spread = (D + G) / variance_inflation + prior + doubt @ np.diag(theta**2) @ doubt
    covariance = inverse @ spread @ inverse
    middle = np.linalg.pinv(spread - prior, hermitian=True)
    information = (D / variance_inflation) @ middle @ (D / variance_inflation)
    return Solution(
        theta,
        (covariance + covariance.T) / 2,
        (information + information.T) / 2,
        variance_inflation,
        nis,
        sums.rows,
    )


def _cluster_factor(
    blocks: Sequence[Block], share: Array, theta: Array, A: Array, model: Model
) -> float:
    """How much wider the scatter of the blocks' scores is than the sums say.

    It is the ratio of clustered to expected variance of each calibration parameter: their mean
    while all could be one noise, else the largest, for an offset that changes half-way shows in
    that offset alone.  What is expected of a block is less than its information, because the fit
    has followed it.  A number that the data hardly move is as uncertain as the prior whatever they
    say of it: its ratio counts for the share of its variance that comes from the data.  1 while
    there are fewer than :data:`~onboard.core.estimate.limits.FEWEST_BLOCKS`.
    """
    if len(blocks) < FEWEST_BLOCKS or "six" not in model.slices:
        return 1.0
    six = model.slices["six"]
    back = np.linalg.inv(A)[six]
    found, expected = np.zeros((2, len(blocks), len(back)))
    for i, p in enumerate(blocks):
        N = p.sums.N
        score = p.sums.b - (N - np.diag(share * np.diag(p.sums.G))) @ theta
        found[i] = (back @ score) ** 2
        followed = N - N @ np.linalg.solve(A, N)
        expected[i] = np.einsum("ij,jk,ik->i", back, followed, back)
    expected = np.maximum(expected, 0.0)
    sum_expected = np.maximum(expected.sum(axis=0), 1e-30)
    ratio = found.sum(axis=0) / sum_expected
    # Blocks that say nothing of a number do not count for it (Satterthwaite 1946).
    blocks_that_count = sum_expected**2 / np.maximum((expected**2).sum(axis=0), 1e-60)
    beyond = ratio > by_chance(blocks_that_count)
    if not beyond.any():
        return float(ratio.mean())
    from_data = np.minimum(sum_expected / np.diag(back[:, six]), 1.0)
    return float((1.0 + (ratio - 1.0) * from_data)[beyond].max())


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
        rest = everything - out
        theta = held.copy()
        A = (rest.N - rest.G + prior)[np.ix_(free, free)]
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
    A = (sums.N - sums.G + prior)[np.ix_(free, free)]
    c = sums.b + prior @ model.prior - sums.N @ theta
    theta[free] = np.linalg.solve(A, c[free])
    return float(np.sqrt(max(sums.residual(theta), 0.0) / max(sums.rows, 1.0)))
