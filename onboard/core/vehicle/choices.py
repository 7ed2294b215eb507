"""Which effects a flight needs: algebra on the sums of one fit with all of them in.

An effect is taken in if the fall of chi-square is more than chance gives to its number of unknowns
and to the number of effects that were tried, if it falls on flight that was not fitted, and if the
difference from the nominal airframe matters beyond its uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.fit import BlockSums, Fit
from onboard.core.vehicle.limits import AMBIGUOUS, CREDIT, FALSE_ALARM, FOLDS, SURE, TESTABLE


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
        self._N = sum((b.N for b in fit.blocks), np.zeros((len(fit.theta),) * 2))
        self._b = sum((b.b for b in fit.blocks), np.zeros(len(fit.theta)))
        self._s = float(sum(b.s for b in fit.blocks))
        self._nominal = fit.model.nominal - fit.theta
        self.folds = _folds(len(fit.blocks))

    @property
    def names(self) -> tuple[str, ...]:
        """Effects in the model."""
        return tuple(dict.fromkeys(e.name for e in self.fit.model.effects if e.name))

    def solved(self, effects: Sequence[str]) -> Solved:
        """With these effects free."""
        x, free = self._at(effects, self._N, self._b)
        f = self.fit
        apart = f.theta + x - f.model.nominal
        squares = self._s - 2.0 * self._b @ x + x @ self._N @ x + f.prior @ (apart * apart)
        information = (self._N + np.diag(f.prior))[np.ix_(free, free)]
        root = np.sqrt(f.inflation[free])
        sigma, covariance = np.zeros(len(x)), np.zeros((len(x),) * 2)
        inside = np.linalg.inv(information) * np.outer(root, root) + f.untold(information, free)
        covariance[np.ix_(free, free)] = inside
        for i, s in zip(free, np.sqrt(np.diag(inside)).tolist(), strict=True):
            sigma[i] = f.model.unknowns[i].doubted(float(f.theta[i] + x[i]), s)
        return Solved(x, sigma, float(squares) / f.scale, covariance)

    def held_out(self, effects: Sequence[str]) -> float:
        """Whitened squares of every fold, each by unknowns of the others; over the inflation."""
        total = 0.0
        for fold, x in self.by_fold(effects):
            N, b, s = _sum([self.fit.blocks[i] for i in fold])
            total += s - 2.0 * float(b @ x) + float(x @ N @ x)
        return total / self.fit.scale

    def by_fold(self, effects: Sequence[str]) -> list[tuple[list[int], Array]]:
        """Blocks of each fold, and (m,) unknowns about the fit's by all other blocks."""
        out = []
        for fold in self.folds:
            N, b, _ = _sum([self.fit.blocks[i] for i in fold])
            x, _ = self._at(effects, self._N - N, self._b - b)
            out.append((fold, x))
        return out

    def lasting(self, effects: Sequence[str], places: Sequence[int], whole: Solved) -> bool:
        """Whether one of these unknowns (places) is off also without any two blocks in a row.

        What is of the vehicle is there all the time, what is of the air for a while (a gust front)
        is not.  Only flight that would show the difference is a witness against it.

        Args:
            effects: that are free.
            places: of the unknowns that are asked about.
            whole: by all blocks.
        """
        f, blocks = self.fit, self.fit.blocks
        lasts = set(places)
        for i in range(len(blocks) - 1):
            N, b, _ = _sum(blocks[i : i + 2])
            x, free = self._at(effects, self._N - N, self._b - b)
            rest = (self._N - N + np.diag(f.prior))[np.ix_(free, free)]
            plain = np.sqrt(np.diag(np.linalg.inv(rest)) * f.inflation[free])
            sigmas = dict(zip(free, plain.tolist(), strict=True))
            for k in tuple(lasts):
                unknown = f.model.unknowns[k]
                apart = abs(f.theta[k] + x[k] - unknown.nominal)
                told = abs(f.theta[k] + whole.x[k] - unknown.nominal) > TESTABLE * sigmas[k]
                if told and apart < unknown.floor + SURE * sigmas[k]:
                    lasts.discard(k)
        return bool(lasts)

    def _at(self, effects: Sequence[str], N: Array, b: Array) -> tuple[Array, list[int]]:
        """Unknowns about the fit's by these sums, and which of them are free."""
        f = self.fit
        free = sorted({i for n in (*effects, "") for i in f.model.indices(n)})
        x = self._nominal.copy()
        x[free] = 0.0
        full_N, full_b = N + np.diag(f.prior), b + f.prior * self._nominal
        rest = full_b - full_N @ x
        x[free] = np.linalg.solve(full_N[np.ix_(free, free)], rest[free])
        return x, free


@dataclass(frozen=True, slots=True)
class Chosen:
    """What was decided.

    Attributes:
        effects: taken in, the strongest first.
        gains: fall of chi-square by each, beside the others.
        rivals: for each, effects that would do as well in its place.
        untestable: effects that this flight could not have shown at any plausible size.
        suspected: those of them that explain more than chance all the same: something is there, of
            which nobody knows the numbers.
    """

    effects: tuple[str, ...]
    gains: dict[str, float]
    rivals: dict[str, tuple[str, ...]]
    untestable: tuple[str, ...]
    suspected: tuple[str, ...] = ()


def choose(choices: Choices) -> Chosen:
    """Take in one effect after the other while one passes; drop what the others made needless."""
    fit = choices.fit
    untestable = tuple(n for n in choices.names if not _testable(fit, n))
    candidates = [n for n in choices.names if n not in untestable]
    level = FALSE_ALARM / max(len(candidates), 1)
    chosen: list[str] = []
    while True:
        now = choices.solved(chosen)
        gains = {n: now.chi2 - choices.solved([*chosen, n]).chi2 for n in candidates}
        passing = [n for n in gains if n not in chosen and _needs(n, chosen)]
        passing = [n for n in passing if _passes(choices, chosen, n, gains[n], level)]
        if not passing:
            break
        chosen.append(max(passing, key=lambda n: gains[n] - CREDIT * len(fit.model.indices(n))))
    chosen, gains = _pruned(choices, chosen, level)
    rivals = {n: _rivals(choices, chosen, n, candidates) for n in chosen}
    asked = [n for n in untestable if _needs(n, chosen)]
    left = choices.solved(chosen).chi2
    would = {n: left - choices.solved([*chosen, n]).chi2 for n in asked}
    suspected = tuple(n for n in asked if _no_chance(choices, chosen, n, would[n], level))
    effects = tuple(sorted(chosen, key=lambda n: -gains[n]))
    return Chosen(effects, gains, rivals, untestable, suspected)


def _needs(name: str, chosen: Sequence[str]) -> bool:
    """A profile is one of a wind."""
    return name != "wind_profile" or "wind" in chosen


def _passes(choices: Choices, chosen: Sequence[str], name: str, gain: float, level: float) -> bool:
    if not _no_chance(choices, chosen, name, gain, level):
        return False
    places = choices.fit.model.indices(name)
    with_it = choices.solved([*chosen, name])
    if not _matters(choices.fit, places, with_it):
        return False
    return choices.lasting([*chosen, name], places, with_it)


def _no_chance(
    choices: Choices, chosen: Sequence[str], name: str, gain: float, level: float
) -> bool:
    """Whether it explains more than chance, also on flight not fitted, whatever its numbers are.

    What gusts may have turned explains nothing: so far from nominal its numbers must be then.
    """
    fit, places = choices.fit, choices.fit.model.indices(name)
    if fit.turned is not None:
        at = choices.solved([*chosen, name])
        off = (fit.theta + at.x - fit.model.nominal)[places]
        gain = min(gain, at.apart(places, off))
    if survival(gain, len(places)) > level:
        return False
    return choices.held_out(chosen) - choices.held_out([*chosen, name]) > 0.0


def _matters(fit: Fit, places: Sequence[int], at: Solved) -> bool:
    """Whether one of the unknowns is off by more than matters, surely."""
    unknowns = fit.model.unknowns
    apart = [abs(fit.theta[i] + at.x[i] - unknowns[i].nominal) for i in places]
    return any(
        d > unknowns[i].floor + SURE * at.sigma[i] for d, i in zip(apart, places, strict=True)
    )


def _pruned(
    choices: Choices, chosen: list[str], level: float
) -> tuple[list[str], dict[str, float]]:
    """Without those that are not needed any more, and what each of the others gains."""
    while True:
        whole = choices.solved(chosen).chi2
        gains = {n: choices.solved([c for c in chosen if c != n]).chi2 - whole for n in chosen}
        needless = []
        for n in chosen:
            others = [c for c in chosen if c != n and _needs(c, [k for k in chosen if k != n])]
            if not _passes(choices, others, n, gains[n], level):
                needless.append(n)
        if not needless:
            return chosen, gains
        weakest = min(needless, key=lambda n: gains[n])
        chosen = [
            c for c in chosen if c != weakest and _needs(c, [k for k in chosen if k != weakest])
        ]


def _rivals(
    choices: Choices, chosen: Sequence[str], name: str, candidates: Sequence[str]
) -> tuple[str, ...]:
    """Effects that are not taken in, and in its place would leave hardly more."""
    whole = choices.solved(chosen).chi2
    rest = [c for c in chosen if c != name]
    return tuple(
        n
        for n in candidates
        if n not in chosen
        and _needs(n, rest)
        and choices.solved([*rest, n]).chi2 - whole < AMBIGUOUS
    )


def _testable(fit: Fit, name: str) -> bool:
    """Whether the largest plausible size would have been seen in one of the unknowns."""
    sigma, unknowns = fit.sigma, fit.model.unknowns
    return any(TESTABLE * sigma[i] < unknowns[i].plausible for i in fit.model.indices(name))


def _folds(blocks: int) -> list[list[int]]:
    """Blocks dealt to folds in turn, neighbours apart."""
    count = min(FOLDS, blocks)
    return [list(range(k, blocks, count)) for k in range(count)] if count > 1 else []


def _sum(blocks: Sequence[BlockSums]) -> tuple[Array, Array, float]:
    N, b = np.zeros_like(blocks[0].N), np.zeros_like(blocks[0].b)
    for block in blocks:
        N, b = N + block.N, b + block.b
    return N, b, float(sum(block.s for block in blocks))
