"""By how much an estimate is less sure than its whitened rows promise.

Rows are never quite as their noise says: what wanders more slowly than a block of flight shows in
the scatter of the blocks' scores, what is of one flight in that of flights.  On a short flight
neither shows it, and errors of known size count (:mod:`onboard.core.vehicle.motion_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.block_sums import BlockSums, total
from onboard.core.vehicle.instruments import LEAST_TOLD
from onboard.core.vehicle.limits import FEWEST_BLOCKS, FEWEST_FLIGHTS

TINY = 1e-300
"""Of a variance: nothing is told [cost]."""


def inflation_of(
    blocks: Sequence[BlockSums],
    prior: Array,
    held: Mask,
    considered: Array,
    *,
    settled: bool = True,
) -> tuple[Array, float]:
    """Variance of the estimate by what is known of its errors, over that of the rows' share of it.

    By blocks it is the cluster-robust (sandwich) estimate (K.-Y. Liang and S. L. Zeger, Biometrika
    73, 1986), with scores as :func:`unfitted` has them.  No unknown has less than the mean of all:
    a few blocks know single ones badly.  Errors of one flight go together (its sensors, its load,
    how well its wind was measured), and flights that contradict each other do not show it from
    block to block: where there are enough of them, their scores' scatter counts, too, if it is the
    larger, and so do errors of known size.

    Args:
        blocks: sums about the estimate.
        prior: (m,) weights.
        held: (m,) whether an unknown is at its bound: its scores have a mean, which is no scatter.
        considered: (m, l) what each error of known size adds to the scores.
        settled: whether the estimate is the likeliest by these sums, and passes near to each.

    Returns:
        (m,) of the variances, and one number for tests of several unknowns: the middle one by the
        scores as they scatter.
    """
    N = total(blocks, len(prior))[0]
    inverse: Array = np.asarray(np.linalg.inv(N + np.diag(prior)), dtype=np.float64)
    known: Array = np.maximum(np.diag(inverse @ N @ inverse), TINY)
    told: Mask = np.diag(inverse) * prior < 0.5
    scores = np.zeros((len(blocks), len(prior)))
    for score, block in zip(scores, blocks, strict=True):
        score[block.places] = block.b
    least = _by_flights(blocks, scores, held, inverse) / known
    plain: Array = np.maximum(_by_blocks(scores, held, inverse, known, told), least)
    out: Array = plain
    if settled:
        as_unfitted = unfitted(blocks, scores, inverse)
        out = np.maximum(_by_blocks(as_unfitted, held, inverse, known, told), least)
    out = np.maximum(out, 1.0 + np.sum((inverse @ considered) ** 2, axis=1) / known)
    return out, float(np.median(plain))


def inflated(information: Array, prior: Array, inflation: Array) -> Array:
    """(m, m) covariance of an estimate whose rows are less sure than they promise.

    What was known before the flight is as sure as it was: of ``P = P N P + P L P`` only the first,
    that of rows ``N``, is inflated.

    Args:
        information: (m, m) of rows and prior, ``P^-1``.
        prior: (m,) weights, the diagonal of ``L``.
        inflation: (m,) as of :func:`inflation_of`.
    """
    # In the directions in which rows and prior are both diagonal each part is a square, whatever
    # rounding has left of it: as a difference of two inverses the rows' may be less than nothing.
    size = 1.0 / np.sqrt(prior)
    told, axes = np.linalg.eigh(size[:, None] * information * size - np.eye(len(prior)))
    told = np.maximum(told, 0.0)
    known = size[:, None] * axes / (1.0 + told)
    by_rows = np.sqrt(inflation)[:, None] * known * np.sqrt(told)
    out: Array = by_rows @ by_rows.T + known @ known.T
    return out


def unfitted(blocks: Sequence[BlockSums], scores: Array, inverse: Array) -> Array:
    """(c, m) scores of blocks, as large as they are of flight that was not fitted.

    An estimate that few blocks have made passes near to each of them, and nearest to the only one
    with a turn.  Scores ``b = L u`` of rows ``N = L L^T`` have a covariance of ``L Q L^T`` about an
    estimate that these rows have a part in, ``Q = 1 - L^T A^-1 L``: they are ``L Q^-1/2 u`` without
    it (R. M. Bell and D. F. McCaffrey, *Survey Methodology* 28, 2002).

    Args:
        blocks: c of them.
        scores: (c, m) theirs.
        inverse: (m, m) of the information of all, ``A^-1``.
    """
    out = np.zeros_like(scores)
    for made, score, block in zip(out, scores, blocks, strict=True):
        its = block.places
        size = np.sqrt(np.maximum(np.diag(block.N), TINY))
        squares, axes = np.linalg.eigh(block.N / np.outer(size, size))
        acting = squares > LEAST_TOLD * squares[-1]
        root = np.sqrt(squares[acting])
        L = size[:, None] * axes[:, acting] * root
        u = axes[:, acting].T @ (score[its] / size) / root
        left, turned = np.linalg.eigh(np.eye(len(u)) - L.T @ inverse[np.ix_(its, its)] @ L)
        made[its] = L @ (turned @ (turned.T @ u / np.sqrt(np.maximum(left, LEAST_TOLD))))
    return out


def _by_blocks(scores: Array, held: Mask, inverse: Array, known: Array, told: Mask) -> Array:
    """(m,) by the scatter of the blocks' scores (c, m); one where they are too few to tell."""
    if len(scores) < FEWEST_BLOCKS:
        return np.ones(len(known))
    ratio = _variances(scores, held, inverse) / known
    mean = float(np.mean(ratio[told])) if told.any() else 1.0
    out: Array = np.maximum(ratio, max(mean, 1.0))
    return out


def _by_flights(blocks: Sequence[BlockSums], scores: Array, held: Mask, inverse: Array) -> Array:
    """(m,) variances by the scatter of flights; none where they are too few to tell.

    What is a flight's own no other one tells: there is no flight without it to be told by.
    """
    numbers, which = np.unique([b.part for b in blocks], return_inverse=True)
    if len(numbers) < FEWEST_FLIGHTS:
        return np.zeros(len(inverse))
    of_flights = np.zeros((len(numbers), len(inverse)))
    np.add.at(of_flights, which, scores)
    return _variances(of_flights, held, inverse)


def _variances(scores: Array, held: Mask, inverse: Array) -> Array:
    """(m,) of an estimate by the scatter of scores (c, m); those of what is held have a mean."""
    apart = scores - np.where(held, np.mean(scores, axis=0), 0.0)
    out: Array = np.sum((apart @ inverse) ** 2, axis=0) * len(scores) / (len(scores) - 1.0)
    return out
