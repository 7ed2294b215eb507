"""Whether a constant of a flight is the same in its parts: latency, averaging, antenna.

A model has one number for each.  Of one that changes, the fit gives a mean that holds nowhere, with
a sigma that knows nothing of it.  So every constant is asked to be the same in the parts of the
flight: in halves, in quarters and so on, down to its blocks.

*The test.*  A constant of k unknowns that has values of its own in each of P parts has k (P - 1)
more: how the parts differ.  What the parts ask for beyond the fit, ``s``, has the covariance ``J``,
the information on these with everything else unknown (Rao 1948; sums are quadratic, so that it is
the likelihood ratio, too).  With ``v`` the directions in which J is diagonal, ``e`` along them,

    g = sum (v s)^2 / (e (V + F^2 e))

is chi-square with as many degrees of freedom as there are directions.  F is what a constant may
differ by from part to part all the same.  The best of all partitions counts, charged for their
number.

*Noise.*  V is its variance over what the sums say.  What it is along a constant, blocks cannot be
asked: what they differ by is in question.  Two answers serve two ends.  A constant is *doubtful*,
too much so to be set, where V is what the blocks' scatter has elsewhere, with all constants free in
every block (the centre of :mod:`onboard.core.estimate.pool`).  The flight *contradicts* its model
where V is as much as the six may have before they contradict themselves
(:data:`~onboard.core.estimate.limits.CONTRADICTION`), for on real flights some directions have it.

*One by one.*  A constant that changes bends what others seem to do.  So the most surprising one is
told, and the others are asked again with it free in every block.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Self

import numpy as np

from onboard.core.diagnosis.effort import MOST_PARTS
from onboard.core.diagnosis.score import least, surprise
from onboard.core.estimate.limits import CONTRADICTION, FEWEST_BLOCKS
from onboard.core.estimate.scatter import Scatter
from onboard.core.estimate.solution import share_of_gram
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, total
from onboard.core.model.regressors import Model

ROUNDING = 1e-9
"""Share of the best known direction below which one is not known at all."""


@dataclass(frozen=True, slots=True)
class Growth:
    """How a model lets a number grow: place of the rate, of it what is taken, since when (s)."""

    index: int
    taken: float
    since: float


@dataclass(frozen=True, slots=True)
class Constant:
    """What a model takes for one number.

    Attributes:
        effect: that it is a size of.
        index: places of its unknowns.
        floor: sigma by which it may differ from part to part all the same, in their unit.
        matters: difference from which it is another one, in their unit.
        growth: that of the model; None: it is a constant.
    """

    effect: str
    index: tuple[int, ...]
    floor: float
    matters: float
    growth: Growth | None = None


@dataclass(frozen=True, slots=True)
class Change:
    """A constant that is none.

    Attributes:
        constant: which.
        score: how surprising it is by chance.
        spans: start and end of each of P parts, s on the boot clock.
        values: (P, k) what it is there.
        sigmas: (P, k) of these.
        contradicts: also where the noise is as large as may be believed.
    """

    constant: Constant
    score: float
    spans: tuple[tuple[float, float], ...]
    values: Array
    sigmas: Array
    contradicts: bool = True

    @property
    def apart(self) -> tuple[int, int, int]:
        """Which two parts differ most surely, the earlier first, and in which unknown."""
        v, s = self.values, self.sigmas
        off = np.abs(v[:, None] - v[None]) / np.hypot(s[:, None], s[None])
        a, b, axis = np.unravel_index(int(np.argmax(off)), off.shape)
        return min(int(a), int(b)), max(int(a), int(b)), int(axis)

    @property
    def size(self) -> float:
        """What it differs by between these two."""
        a, b, axis = self.apart
        return abs(float(self.values[a, axis] - self.values[b, axis]))


@dataclass(frozen=True, slots=True)
class Pieces:
    """Sums of P pieces of a flight for m unknowns, counted from what all of them ask for.

    Attributes:
        theta: (m,) that fit.
        N: (P, m, m) information.
        s: (P, m) what each asks for beyond the fit of all.
        prior: (m,) information of it; where the fit is, it pulls by ``- sum s``.
        square: sum of the squared residuals.
        rows: innovations, less unknowns that are free in each piece.
        spans: start and end of each, s on the boot clock.
    """

    theta: Array
    N: Array
    s: Array
    prior: Array
    square: float
    rows: float
    spans: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, blocks: Sequence[Block], model: Model) -> Self:
        """A flight, neighbouring blocks together where there are many, about its fit."""
        parts = np.array_split(np.arange(len(blocks)), min(MOST_PARTS, len(blocks)))
        sums = [total([blocks[i] for i in part]) for part in parts]
        prior = 1.0 / model.prior_sigma**2
        # Of a part alone noise may be more than there is: what is left must stay a variance, with
        # a part's share of the prior, which all of them have once.
        own = np.diag(prior) / len(sums)
        N = np.array([p.N - share_of_gram(p, own) * p.G for p in sums])
        b = np.array([p.b for p in sums])
        asked = b.sum(axis=0) + prior * model.prior
        theta = np.linalg.solve(N.sum(axis=0) + np.diag(prior), asked)
        return cls(
            theta,
            N,
            b - N @ theta,
            prior,
            sum(p.residual(theta) for p in sums),
            sum(p.rows for p in sums),
            tuple((blocks[part[0]].start, blocks[part[-1]].end) for part in parts),
        )

    def joined(self, parts: int) -> Self:
        """The same in so many parts."""
        first = [int(p[0]) for p in np.array_split(np.arange(len(self.s)), parts)]
        last = [*(i - 1 for i in first[1:]), len(self.s) - 1]
        ends = zip(first, last, strict=True)
        return replace(
            self,
            N=np.add.reduceat(self.N, first),
            s=np.add.reduceat(self.s, first),
            spans=tuple((self.spans[a][0], self.spans[b][1]) for a, b in ends),
        )

    def freed(self, index: Sequence[int]) -> tuple[Self, Array, Array]:
        """The same where some unknowns have values of their own in each piece.

        They stay as unknowns of which nothing is known; all others are fitted anew.

        Returns:
            The pieces; the values (P, k) of the unknowns ``index`` in each, and their sigmas.
        """
        own = list(index)
        K = np.linalg.inv(self.N[:, own][:, :, own] + np.diag(self.prior[own]))
        cross, pull = self.N[:, :, own].copy(), -self.s.sum(axis=0)
        known = float(np.einsum("pij,pji->", K, cross[:, own]))
        cross[:, own], pull[own] = 0.0, 0.0
        back = K @ cross.transpose(0, 2, 1)
        asked = np.einsum("pij,pj->pi", K, self.s[:, own])
        N, s = self.N - cross @ back, self.s - np.einsum("pij,pj->pi", cross, asked)
        N[:, own], N[:, :, own], s[:, own] = 0.0, 0.0, 0.0
        gone = float(np.sum(self.s[:, own] * asked))
        made, step, C = self._fitted(N, s, pull, gone, known)
        variance = K + back @ C @ back.transpose(0, 2, 1)
        values = self.theta[own] + asked - back @ step
        return made, values, np.sqrt(np.diagonal(variance, axis1=1, axis2=2))

    def apart(self, index: Sequence[int]) -> Array:
        """(P,) chi-square that each piece gains by values of its own of some unknowns."""
        own = list(index)
        C = np.linalg.inv(self.N.sum(axis=0) + np.diag(self.prior))
        rows, s = self.N[:, own], self.s[:, own]
        J = rows[:, :, own] - rows @ C @ rows.transpose(0, 2, 1)
        most = rows[:, :, own].sum(axis=0) + np.diag(self.prior[own])  # without it, maybe nothing
        told = np.linalg.eigvalsh(J)[:, 0] > ROUNDING * np.trace(most)
        J[~told] = np.eye(len(own))  # of which it knows nothing
        gains: Array = np.einsum("pi,pi->p", s, np.linalg.solve(J, s[..., None])[..., 0])
        return np.where(told, gains, 0.0)

    def silenced(self, piece: int, index: Sequence[int]) -> Self:
        """The same where one piece has values of its own of some unknowns, and tells none."""
        own, N, s = list(index), self.N.copy(), self.s.copy()
        K = np.linalg.inv(N[piece][np.ix_(own, own)])
        cross = N[piece][:, own].copy()
        asked = K @ s[piece, own]
        N[piece] -= cross @ K @ cross.T
        s[piece] -= cross @ asked
        N[piece, own], N[piece][:, own], s[piece, own] = 0.0, 0.0, 0.0
        pull = -self.s.sum(axis=0)
        return self._fitted(N, s, pull, float(self.s[piece, own] @ asked), float(len(own)))[0]

    def _fitted(
        self, N: Array, s: Array, pull: Array, gone: float, known: float
    ) -> tuple[Self, Array, Array]:
        """All unknowns anew, of pieces from which some have been taken.

        Args:
            N: (P, m, m) what the pieces know.
            s: (P, m) what they ask for beyond the fit before.
            pull: (m,) of the prior there.
            gone: what those that were taken have explained.
            known: rows that they have used up.

        Returns:
            The pieces; the step (m,); its covariance (m, m).
        """
        total_N, total_s = N.sum(axis=0), s.sum(axis=0)
        C = np.linalg.inv(total_N + np.diag(self.prior))
        step: Array = C @ (total_s + pull)
        fall = gone + float(step @ (2.0 * total_s - total_N @ step))
        made = replace(
            self,
            theta=self.theta + step,
            N=N,
            s=s - N @ step,
            square=self.square - fall,
            rows=self.rows - known,
        )
        return made, step, C

    def held(self, index: int) -> Self:
        """The same with an unknown that stays as it is."""
        N, s = self.N.copy(), self.s.copy()
        N[:, index], N[:, :, index], s[:, index] = 0.0, 0.0, 0.0
        return replace(self, N=N, s=s)

    def scatter(self, least_variance: float) -> float:
        """Variance over what the sums say of what the pieces differ by, no less than some."""
        if len(self.s) < FEWEST_BLOCKS:
            return least_variance
        C = np.linalg.inv(self.N.sum(axis=0) + np.diag(self.prior))
        return Scatter(self, self.s, C).pool(self.prior, least_variance).variance

    def information(self) -> Iterator[tuple[slice, Array]]:
        """Which pieces, and what they know: (P, m, m), as a scatter asks for it."""
        yield slice(None), self.N

    def gain(self, index: Sequence[int], floor: float, variance: float) -> tuple[float, int]:
        """What values of its own in each piece gain for a constant: chi-square and its freedom."""
        own, P = list(index), len(self.s)
        C = np.linalg.inv(self.N.sum(axis=0) + np.diag(self.prior))
        rows = self.N[:, own].reshape(P * len(own), -1)
        J = -rows @ C @ rows.T
        J = J.reshape(P, len(own), P, len(own))
        J[range(P), :, range(P)] += self.N[:, own][:, :, own]
        apart = np.eye(P) - 1.0 / P  # what all of them have is no difference
        J = np.einsum("pq,qirj,rt->pitj", apart, J, apart, optimize=True)
        e, v = np.linalg.eigh(J.reshape(rows.shape[0], -1))
        known = e > ROUNDING * max(float(e[-1]), ROUNDING)
        e, s = e[known], v[:, known].T @ (apart @ self.s[:, own]).ravel()
        return float(np.sum(s**2 / (e * (variance + floor**2 * e)))), int(known.sum())


def changes(
    blocks: Sequence[Block], model: Model, constants: Sequence[Constant]
) -> tuple[Change, ...]:
    """Constants that are none, the most surprising first.

    Args:
        blocks: sums of the flight.
        model: their unknowns.
        constants: what is asked.
    """
    flight = Pieces.of(blocks, model)
    if len(flight.s) < 2:
        return ()
    loose = flight.freed([i for c in constants for i in c.index])[0]
    excess = max(1.0, loose.square / max(loose.rows, 1.0))
    most = CONTRADICTION * excess
    usual = min(loose.scatter(excess), most)
    out: list[Change] = []
    left, beside = list(constants), flight
    while left:
        tried = [_tried(beside, c, most) for c in left]
        if max(change.score for change in tried) < least():
            tried = [replace(_tried(beside, c, usual), contradicts=False) for c in left]
        best = max(tried, key=lambda change: change.score)
        if best.score < least():
            break
        out.append(best)
        left.remove(best.constant)
        beside = beside.freed(best.constant.index)[0]
    return tuple(c for c in out if c.size >= c.constant.matters)


def _tried(flight: Pieces, c: Constant, variance: float) -> Change:
    """A constant in the partition in which it differs most surprisingly."""
    most = len(flight.s)
    counts = [*(2**k for k in range(1, most.bit_length()) if 2**k < most), most]
    best, score = flight, -inf
    for n in counts:
        parts = flight.joined(n)
        gain, unknowns = parts.gain(c.index, c.floor, variance)
        here = surprise(gain, unknowns, len(counts)) if unknowns else -inf
        if here > score:
            best, score = parts, here
    grown = 0.0
    if c.growth is not None:
        middle = np.array(best.spans).mean(axis=1, keepdims=True) - c.growth.since
        grown = (c.growth.taken + best.theta[c.growth.index]) * middle
        best = best.held(c.growth.index)
    _, values, sigmas = best.freed(c.index)
    values = values + grown
    return Change(c, score, best.spans, values, sigmas * sqrt(variance))
