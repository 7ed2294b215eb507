"""How much blocks of a flight contradict each other, direction by direction of a model.

Whitened innovations are independent only as far as the noise model is right.  The scores of the
blocks (what each asks for beyond the fit) say by how much it is not: their scatter is the variance
there is, whatever the sums say (cluster-robust, Huber 1967, White 1980; clustered by time).  It is
not the same in every direction.  What a vehicle's vibration does to a scale, it does not do to an
offset or to the latency of GPS; one factor for all, the largest, would silence a flight for one bad
number, and their mean would believe the bad one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from onboard.core.estimate.limits import BLOCKS_TOGETHER, FEWEST_FREEDOM, KNOWN
from onboard.core.estimate.pool import TINY, Pool
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, whole


class Informed(Protocol):
    """Parts of a flight, some at a time."""

    def information(self) -> Iterator[tuple[slice, Array]]:
        """Which parts, and what they know: (b, n, n)."""
        ...


class Scatter:
    """Scores of the blocks of a flight beyond one fit, and what the sums expect of them."""

    def __init__(
        self, blocks: Informed, scores: Array, inverse: Array, index: list[int] | None = None
    ) -> None:
        """Take what the blocks say, and the fit.

        Args:
            blocks: with sums of n unknowns.
            scores: (blocks, m) of the fit's unknowns.
            inverse: (m, m) the fit's covariance, that of the sums with the prior.
            index: the m of the n unknowns that the fit has; None: all.
        """
        self._blocks, self._scores, self.inverse, self._index = blocks, scores, inverse, index

    @classmethod
    def of(
        cls, blocks: Sequence[Block], theta: Array, inverse: Array, gram_share: float
    ) -> Scatter:
        """About a fit of all unknowns.

        Args:
            blocks: with sums of m unknowns.
            theta: (m,) what was found.
            inverse: (m, m) its covariance by the sums.
            gram_share: of the noise's Gram that was taken out of the regressors.
        """
        stacked = Stacked(blocks)
        return cls(stacked, stacked.scores(theta, gram_share), inverse)

    def pool(self, prior_information: Array, least: float) -> Pool:
        """What variance the unknowns' own estimates have.

        Args:
            prior_information: (m,) of the unknowns; one of which the data know less than the prior
                says nothing of the noise.
            least: variance that is claimed at least.
        """
        known = np.diag(self.inverse) * prior_information < KNOWN
        found, expected = self._along(self.inverse[:, known])
        total = np.maximum(expected.sum(axis=0), TINY)
        return Pool.of(found.sum(axis=0) / total, _counted(expected), least)

    def within(self, directions: Array) -> tuple[float, float]:
        """Variance over what the sums say of ``directions`` (m, k) as one, and blocks that count.

        Each is in units of what is expected; blocks that say nothing do not count (Satterthwaite
        1946).
        """
        found, expected = self._along(directions)
        unit = np.maximum(expected.sum(axis=0), TINY)
        ratio = float(np.mean(found.sum(axis=0) / unit))
        return ratio, float(_counted((expected / unit).sum(axis=1, keepdims=True))[0])

    def noise(self, X: Array, strength: Array, pool: Pool, *, widened: bool = True) -> Array:
        """Covariance (m, m) of what the data say along ``X``, in units of what the sums claim.

        In no direction is it less than the sums claim.

        Args:
            X: (m, m) directions in which the data's information is diagonal.
            strength: (m,) that information; along the weak ones all is as the pool is.
            pool: of the flight.
            widened: that of Student's t: what is known with few degrees of freedom is wider.
        """
        if math.isinf(pool.freedom):
            return np.eye(len(strength)) * max(pool.variance, 1.0)
        expected = self._along(X)[1]
        unit = np.sqrt(np.maximum(expected.sum(axis=0), TINY))
        own = np.where(strength > 1.0, _counted(expected), 0.0)
        total = pool.freedom + own
        freedom = np.maximum(total, FEWEST_FREEDOM)
        wider = freedom / (freedom - 2.0) if widened else np.ones(len(freedom))
        share = np.sqrt(wider * own / total) / unit
        scores = self._scores @ X * share
        V = scores.T @ scores + np.diag(wider * pool.variance * pool.freedom / total)
        size, turned = np.linalg.eigh(V)
        out: Array = (turned * np.maximum(size, 1.0)) @ turned.T
        return out

    def _along(self, X: Array) -> tuple[Array, Array]:
        """Squared scores (blocks, k), and what is expected of them.

        What is expected of a block is less than its information: the fit has followed it.
        """
        found = (self._scores @ X) ** 2
        expected = np.empty_like(found)
        for part, N in self._blocks.information():
            NX = self._times(N, X)
            followed = np.einsum("bmk,bmk->bk", NX, self.inverse @ NX)
            expected[part] = np.einsum("mk,bmk->bk", X, NX) - followed
        return found, np.maximum(expected, 0.0)

    def _times(self, N: Array, X: Array) -> Array:
        """(b, m, k) information (b, n, n) of the fit's unknowns, times ``X`` (m, k)."""
        if self._index is None:
            return N @ X
        # Fewer directions than unknowns: to take the fit's out of N costs more than these.
        every = np.zeros((N.shape[1], X.shape[1]))
        every[self._index] = X
        out: Array = (N @ every)[:, self._index]
        return out


def _counted(expected: Array) -> Array:
    """How many blocks count, given what is expected of each: (blocks, k) to (k,)."""
    total = np.maximum(expected.sum(axis=0), TINY)
    out: Array = total**2 / np.maximum((expected**2).sum(axis=0), TINY**2)
    return out


class Stacked:
    """Sums of blocks side by side; their information some at a time: of hours it is much."""

    def __init__(self, blocks: Sequence[Block]) -> None:
        """Take blocks with sums of n unknowns."""
        self._blocks = list(blocks)
        self._b = np.stack([p.b for p in blocks])
        self._all = self._stack(slice(None)) if len(blocks) <= BLOCKS_TOGETHER else None

    def information(self) -> Iterator[tuple[slice, Array]]:
        """Which blocks, and what they know: (b, n, n)."""
        for first in range(0, len(self._blocks), BLOCKS_TOGETHER):
            part = slice(first, first + BLOCKS_TOGETHER)
            yield part, self._stack(part) if self._all is None else self._all

    def scores(self, theta: Array, gram_share: float = 1.0) -> Array:
        """What each block asks for beyond ``theta`` (n,): (blocks, n).

        ``gram_share`` is the share of the noise's Gram that is taken out of the regressors.
        """
        out = self._b + gram_share * np.stack([p.noise_along(theta) for p in self._blocks])
        for part, N in self.information():
            out[part] -= N @ theta
        return out

    def _stack(self, part: slice) -> Array:
        return whole([p.half for p in self._blocks[part]], self._b.shape[1])
