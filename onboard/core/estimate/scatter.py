"""How much blocks of a flight contradict each other, direction by direction of a model.

Whitened innovations are independent only as far as the noise model is right.  The scores of the
blocks (what each asks for beyond the fit) say by how much it is not: their scatter is the variance
there is, whatever the sums say (cluster-robust, Huber 1967, White 1980; clustered by time).  It is
not the same in every direction.  What a vehicle's vibration does to a scale, it does not do to an
offset or to the latency of GPS; one factor for all, the largest, would silence a flight for one bad
number, and their mean would believe the bad one.

In one direction few blocks count, and their scatter is itself uncertain.  So the variances of all
directions of a flight are taken for draws from one distribution (inverse chi-square, its centre and
its width found from them), and each is shrunk towards the centre by as much as it is uncertain: the
moderated variances of Smyth (2004).  On a flight whose noise is as the model says all directions
become one, and on one that contradicts itself each stands for itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.limits import FEWEST_FREEDOM
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block

TINY = 1e-30
"""Information of a direction of which no block says anything."""
KNOWN = 0.5
"""Share of the prior's variance below which the data know more than it."""


@dataclass(frozen=True, slots=True)
class Pool:
    """What variance the directions of one flight have: centre, and degrees of freedom of it."""

    variance: float = 1.0
    freedom: float = math.inf

    @classmethod
    def of(cls, ratio: Array, count: Array, least: float) -> Pool:
        """The likeliest centre and width, given the scatter in every direction.

        A ratio is then distributed as Fisher's F.  Of one below ``least`` only that is used: a
        noise level that is too high is no contradiction.

        Args:
            ratio: (k,) variance over what the sums say.
            count: (k,) blocks that count for it.
            least: the centre is no smaller.
        """
        if not np.any(ratio > least):
            return cls(least)
        centres = np.geomspace(least, float(ratio.max()), CENTRES)
        chances = [_log_likelihood(ratio, count, centres, f, least) for f in FREEDOMS]
        i, j = np.unravel_index(int(np.argmax(chances)), (len(FREEDOMS), CENTRES))
        return cls(float(centres[j]), FREEDOMS[i])

    def moderated(self, ratio: float, count: float) -> tuple[float, float]:
        """A variance shrunk towards the centre by its own uncertainty, and its freedom."""
        if math.isinf(self.freedom):
            return self.variance, self.freedom
        total = self.freedom + count
        return (self.freedom * self.variance + count * ratio) / total, total


FREEDOMS = (math.inf, 64.0, 32.0, 16.0, 11.0, 8.0, 5.6, 4.0, 2.8, 2.0, 1.4)
CENTRES = 16
"""Where a pool is looked for: closer than they are known."""
BELOW = np.geomspace(1e-3, 1.0, 24)
"""Shares of the least centre at which the density below it is summed."""


def _log_likelihood(
    ratio: Array, count: Array, centres: Array, freedom: float, least: float
) -> Array:
    """Of ratios (k,), with each of the centres (c,): (c,)."""
    above = ratio > least
    inside = _log_density(ratio[above] / centres[:, None], count[above], freedom)
    out: Array = np.sum(inside - np.log(centres)[:, None], axis=1)
    u = BELOW[:, None] * (least / centres)[:, None, None]
    under = np.trapezoid(np.exp(_log_density(u, count[~above], freedom)) * u, np.log(BELOW), axis=1)
    out += np.log(np.maximum(under, TINY)).sum(axis=1)
    return out


def _log_density(u: Array, n: Array, freedom: float) -> Array:
    """Of Fisher's F with ``n`` and ``freedom`` degrees; of chi-square over ``n`` without end."""
    half = 0.5 * n
    front = -np.array([math.lgamma(h) for h in half])
    if math.isinf(freedom):
        front += half * np.log(half)
        tail = half * u
    else:
        front += np.array([math.lgamma(h + 0.5 * freedom) for h in half])
        front += half * np.log(n / freedom) - math.lgamma(0.5 * freedom)
        tail = (half + 0.5 * freedom) * np.log1p(n * u / freedom)
    out: Array = front + (half - 1.0) * np.log(u) - tail
    return out


class Scatter:
    """Scores of the blocks of a flight beyond one fit, and what the sums expect of them."""

    def __init__(self, N: Array, scores: Array, inverse: Array) -> None:
        """Take the blocks' information (b, m, m), scores (b, m), and the fit's covariance (m, m).

        The covariance is that of the sums with the prior.
        """
        self._N, self._scores, self.inverse = N, scores, inverse

    @classmethod
    def of(
        cls, blocks: Sequence[Block], theta: Array, inverse: Array, gram_share: Array
    ) -> Scatter:
        """About a fit of all unknowns.

        Args:
            blocks: with sums of m unknowns.
            theta: (m,) what was found.
            inverse: (m, m) its covariance by the sums.
            gram_share: (m,) share of the noise's Gram that was taken out of the regressors.
        """
        N, b, gram = stacked(blocks)
        return cls(N, scores_of(N, b, gram_share * gram, theta), inverse)

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

    def noise(self, X: Array, strength: Array, pool: Pool) -> Array:
        """Covariance (m, m) of what the data say along ``X``, in units of what the sums claim.

        In no direction is it less than the sums claim.  It is that of Student's t: what is known
        with few degrees of freedom is wider.

        Args:
            X: (m, m) directions in which the data's information is diagonal.
            strength: (m,) that information; along the weak ones all is as the pool is.
            pool: of the flight.
        """
        if math.isinf(pool.freedom):
            return np.eye(len(strength)) * max(pool.variance, 1.0)
        expected = self._along(X)[1]
        unit = np.sqrt(np.maximum(expected.sum(axis=0), TINY))
        own = np.where(strength > 1.0, _counted(expected), 0.0)
        total = pool.freedom + own
        freedom = np.maximum(total, FEWEST_FREEDOM)
        widened = freedom / (freedom - 2.0)
        share = np.sqrt(widened * own / total) / unit
        scores = self._scores @ X * share
        V = scores.T @ scores + np.diag(widened * pool.variance * pool.freedom / total)
        size, turned = np.linalg.eigh(V)
        out: Array = (turned * np.maximum(size, 1.0)) @ turned.T
        return out

    def _along(self, X: Array) -> tuple[Array, Array]:
        """Squared scores (blocks, k), and what is expected of them.

        What is expected of a block is less than its information: the fit has followed it.
        """
        NX = self._N @ X
        followed = np.einsum("bmk,bmk->bk", NX, self.inverse @ NX)
        expected = np.einsum("mk,bmk->bk", X, NX) - followed
        return (self._scores @ X) ** 2, np.maximum(expected, 0.0)


def _counted(expected: Array) -> Array:
    """How many blocks count, given what is expected of each: (blocks, k) to (k,)."""
    total = np.maximum(expected.sum(axis=0), TINY)
    out: Array = total**2 / np.maximum((expected**2).sum(axis=0), TINY**2)
    return out


def stacked(blocks: Sequence[Block]) -> tuple[Array, Array, Array]:
    """Sums of K blocks: N (K, m, m), b (K, m), diagonals of the noise's Gram (K, m)."""
    return (
        np.stack([p.sums.N for p in blocks]),
        np.stack([p.sums.b for p in blocks]),
        np.stack([np.diag(p.sums.G) for p in blocks]),
    )


def scores_of(N: Array, b: Array, gram: Array, theta: Array) -> Array:
    """What each block asks for beyond ``theta`` (m,): (K, m)."""
    out: Array = b - N @ theta + gram * theta
    return out


def directions_of(information: Array, prior_information: Array) -> tuple[Array, Array]:
    """Directions that are independent in the data and in the prior alike.

    Args:
        information: (m, m) of the data.
        prior_information: (m,) of the prior, independent unknowns.

    Returns:
        X (m, m) with ``X^T P X = 1``, and (m,) what the data know along each, in units of the
        prior.
    """
    root = 1.0 / np.sqrt(prior_information)
    strength, turned = np.linalg.eigh(information * np.outer(root, root))
    return root[:, None] * turned, strength


class Weighing:
    """Data with what the sums claim, and a prior, to an estimate with what blocks confirm.

    In the coordinates ``X``, counted from the prior's centre, the prior is one and the data are
    ``strength``; their noise is ``V`` times that.  Each direction is weighed by its own variance.
    That the noise of two goes together is in the covariance alone: as a weight it would have to be
    known better than blocks tell it, and made a plane's estimates a third worse.
    """

    def __init__(self, X: Array, strength: Array, V: Array) -> None:
        """Take directions (m, m), information along them (m,) and noise (m, m)."""
        self.X = X
        self.weights: Array = 1.0 / np.diag(V)
        root = np.sqrt(np.maximum(strength, TINY))
        size, turned = np.linalg.eigh(V)
        half = (turned * np.sqrt(size)) @ turned.T
        self._noisy: Array = self.weights[:, None] * half * np.outer(root, 1.0 / root)
        self.information: Array = np.maximum(strength, 0.0) * self.weights
        self.gain: Array = X / (self.information + 1.0)

    def estimate(self, score: Array) -> Array:
        """(m,) from what the data ask for beyond the prior's centre, (m,)."""
        out: Array = self.gain @ (self.weights * (self.X.T @ score))
        return out

    def noise(self, claimed: Array) -> Array:
        """(m, m) along ``X`` of weighted scores of which the sums claim the noise (m, m)."""
        back = self._noisy @ self.X.T
        out: Array = back @ claimed @ back.T
        return out

    def covariance(self, noise: Array) -> Array:
        """(m, m) of the estimate, with that noise of the weighted scores."""
        out: Array = self.gain @ (noise + np.eye(len(noise))) @ self.gain.T
        return (out + out.T) / 2
