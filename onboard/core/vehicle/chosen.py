"""Which effects a flight needs, and which it could not have shown.

An effect is taken in if the fall of chi-square is more than chance gives to its number of unknowns
and to the number of effects that were tried, if it falls on flight that was not fitted, and if the
difference from the nominal airframe matters beyond its uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from onboard.core.maths.chi_square import survival
from onboard.core.vehicle.choices import Choices, Solved
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import AMBIGUOUS, CREDIT, FALSE_ALARM, SURE, TESTABLE


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
    rivals = {n: _rivals(choices, chosen, n) for n in chosen}
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


def _rivals(choices: Choices, chosen: Sequence[str], name: str) -> tuple[str, ...]:
    """Effects that are not taken in, and in its place would leave hardly more.

    Also of those that this flight could not have shown: that nobody knows their numbers is no
    reason why it should not be they.
    """
    whole = choices.solved(chosen).chi2
    rest = [c for c in chosen if c != name]
    return tuple(
        n
        for n in choices.names
        if n not in chosen
        and _needs(n, rest)
        and choices.solved([*rest, n]).chi2 - whole < AMBIGUOUS
    )


def _testable(fit: Fit, name: str) -> bool:
    """Whether the largest plausible size would have been seen in one of the unknowns."""
    sigma, unknowns = fit.sigma, fit.model.unknowns
    return any(TESTABLE * sigma[i] < unknowns[i].plausible for i in fit.model.indices(name))
