"""Which effects a flight needs, and which it could not have shown.

An effect is needed if chi-square falls by more than chance gives to its number of unknowns and to
the number of effects that were tried, if it falls on flight that was not fitted, and if the
difference from the nominal airframe matters beyond its uncertainty.  Beside it are free the others
that were chosen, and those that the flight could not have shown: nobody knows that they are
nominal.  As told, with everything free, it must differ by more than matters, too; and surely, where
another effect would do as well.  What passes while all others are nominal is one of several that
may be it: no name, and not *explained*.

All effects are the choice to begin with, and the needless are dropped.  Effects that undo each
other (more thrust by a curve of less) are only seen together; for both a third would be taken in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
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
        suspected: effects that explain more than chance and are not taken in all the same, because
            nobody knows their numbers: something is there.
        partly: effects of which gusts hide a part: an unknown of theirs is not testable.
        together: of the suspected, those of the thrust: the flight determines what they make
            together, and not one by one.
    """

    effects: tuple[str, ...]
    gains: dict[str, float]
    rivals: dict[str, tuple[str, ...]]
    untestable: tuple[str, ...]
    suspected: tuple[str, ...] = ()
    partly: tuple[str, ...] = ()
    together: tuple[str, ...] = ()

    @property
    def taken(self) -> tuple[str, ...]:
        """Effects whose numbers are used: named, or known together."""
        return (*self.effects, *self.together)


def choose(choices: Choices) -> Chosen:
    """Drop what the others make needless, take in what passes now, until neither is any."""
    fit = choices.fit
    untestable = tuple(n for n in choices.names if not _testable(fit, n))
    candidates = [n for n in choices.names if n not in untestable]
    level = FALSE_ALARM / max(len(candidates), 1)
    chosen, _ = _pruned(choices, candidates, untestable, level)
    while True:
        beside = [*chosen, *untestable]
        now = choices.solved(beside)
        gains = {n: now.chi2 - choices.solved([*beside, n]).chi2 for n in candidates}
        passing = [n for n in gains if n not in chosen and _needs(n, chosen)]
        passing = [n for n in passing if _passes(choices, beside, n, gains[n], level)]
        if not passing:
            break
        counted = {n: _counted(choices, beside, n, gains[n]) for n in passing}
        chosen.append(max(passing, key=lambda n: counted[n] - CREDIT * len(fit.model.indices(n))))
    chosen, gains, rivals = _settled(choices, chosen, untestable, level)
    effects = tuple(sorted(chosen, key=lambda n: -gains[n]))
    suspected = _suspected(choices, chosen, level)
    hidden = () if fit.turned is None else candidates
    partly = tuple(n for n in hidden if any(_untestable(fit, fit.model.indices(n))))
    together = _together(choices, effects, suspected, level)
    return Chosen(effects, gains, rivals, untestable, suspected, partly, together)


def _settled(
    choices: Choices, chosen: list[str], untestable: Sequence[str], level: float
) -> tuple[list[str], dict[str, float], dict[str, tuple[str, ...]]]:
    """Those that are needed and known, what each gains, and its rivals.

    The score takes all others for nominal.  Where one of those would do as well, that is no
    knowledge, and what is known of the number is what is told, with everything free: if it may as
    well be nominal, nobody knows which of the two it is, and neither has a name.
    """
    while True:
        chosen, gains = _pruned(choices, chosen, untestable, level)
        rivals = {n: _rivals(choices, chosen, n) for n in chosen}
        indices = choices.fit.model.indices
        unknown = [
            n for n in chosen if rivals[n] and not _matters(choices.fit, indices(n), choices.told)
        ]
        if not unknown:
            return chosen, gains, rivals
        weakest = min(unknown, key=lambda n: gains[n])
        chosen = _without(chosen, weakest)


def _together(
    choices: Choices, chosen: Sequence[str], suspected: Sequence[str], level: float
) -> tuple[str, ...]:
    """Of effects that nobody knows the numbers of, those of a thrust that surely is not nominal.

    A hover has one thrust for one throttle, which a curve, a battery that gives way or a mass may
    make: none of the three is known by it, and the thrust is, to a per cent.  So what is asked is
    how far from nominal all of them are together, with everything free, and whether flight that was
    not fitted is described better with them.
    """
    fit = choices.fit
    its = tuple(n for n in suspected if fit.model.effect(n).commanded)
    places = [k for n in its for k in fit.model.indices(n)]
    if not places:
        return ()
    told = choices.told
    surely = survival(told.apart(places, _off(fit, places, told)), len(places)) < level
    better = choices.held_out([*chosen, *its]) < choices.held_out(chosen)
    return its if surely and better else ()


def _suspected(choices: Choices, chosen: Sequence[str], level: float) -> tuple[str, ...]:
    """Effects that are not taken in, and explain more than chance by numbers that may matter.

    One of several that may be it would pass if all others were nominal.  To be named, an effect is
    off by more than matters, and by :data:`SURE` beyond; that it is not there can no longer be said
    from where it is off by more than matters.  Where gusts leave one combination of an effect's
    numbers, it has to be large to be named.  That nothing is there is then no longer sure from
    where the combination is off by :data:`SURE`.
    """
    left = choices.solved(chosen).chi2
    out = []
    for n in choices.names:
        if n in chosen or not _needs(n, chosen):
            continue
        places = choices.fit.model.indices(n)
        its = level
        gain = left - choices.solved([*chosen, n]).chi2
        if together_testable(choices.fit, places) is not None:
            its = math.erfc(SURE / math.sqrt(2.0))
        elif _testable(choices.fit, n):
            if _would_pass(choices, chosen, n, gain, level, sure=0.0):
                out.append(n)
            continue
        with_it = choices.solved([*chosen, n])
        slight = _slight(choices.fit, places, with_it)
        if not slight and _no_chance(choices, chosen, n, gain, its):
            out.append(n)
    return tuple(out)


def _needs(name: str, chosen: Sequence[str]) -> bool:
    """A profile is one of a wind."""
    return name != "wind_profile" or "wind" in chosen


def _passes(choices: Choices, beside: Sequence[str], name: str, gain: float, level: float) -> bool:
    """Whether it is needed beside these, and differs as it is told, with everything free."""
    places = choices.fit.model.indices(name)
    told = _matters(choices.fit, places, choices.told, sure=0.0)
    return told and _would_pass(choices, beside, name, gain, level)


def _would_pass(
    choices: Choices,
    chosen: Sequence[str],
    name: str,
    gain: float,
    level: float,
    sure: float = SURE,
) -> bool:
    """Whether it is needed beside these, with all others at their nominal numbers."""
    if not _no_chance(choices, chosen, name, gain, level):
        return False
    places = choices.fit.model.indices(name)
    with_it = choices.solved([*chosen, name])
    if not _matters(choices.fit, places, with_it, sure):
        return False
    return choices.lasting([*chosen, name], places, with_it)


def _no_chance(
    choices: Choices, chosen: Sequence[str], name: str, gain: float, level: float
) -> bool:
    """Whether it explains more than chance, also on flight not fitted, whatever its numbers are."""
    fit, places = choices.fit, choices.fit.model.indices(name)
    gain = _counted(choices, chosen, name, gain)
    # What is known of unknowns together is one number.
    count = len(places) if together_testable(fit, places) is None else 1
    if survival(gain, count) > level:
        return False
    return choices.held_out(chosen) - choices.held_out([*chosen, name]) > 0.0


def _counted(choices: Choices, chosen: Sequence[str], name: str, gain: float) -> float:
    """What of a fall of chi-square counts: what regressors may be bent by explains nothing.

    So far from nominal its numbers must be then.
    """
    fit, places = choices.fit, choices.fit.model.indices(name)
    if fit.turned is None and fit.answered is None:
        return gain
    at = choices.solved([*chosen, name])
    return min(gain, at.apart(places, _off(fit, places, at)))


def _matters(fit: Fit, places: Sequence[int], at: Solved, sure: float = SURE) -> bool:
    """Whether an unknown, or what is known of all, is off by so many sigmas more than matters."""
    unknowns = fit.model.unknowns
    off = _off(fit, places, at)
    each = [(unknowns[i].floor, float(at.sigma[i])) for i in places]
    if any(abs(d) > floor + sure * s for d, (floor, s) in zip(off.tolist(), each, strict=True)):
        return True
    way = together_testable(fit, places)
    if way is None:
        return False
    size, floor, sigma = _along(fit, places, at, way)
    return size > floor + sure * sigma


def _slight(fit: Fit, places: Sequence[int], at: Solved) -> bool:
    """Whether what is known of unknowns together is surely off by no more than matters."""
    way = together_testable(fit, places)
    if way is None:
        return False
    size, floor, sigma = _along(fit, places, at, way)
    return size + SURE * sigma < floor


def _off(fit: Fit, places: Sequence[int], at: Solved) -> Array:
    out: Array = (fit.theta + at.x - fit.model.nominal)[list(places)]
    return out


def _along(fit: Fit, places: Sequence[int], at: Solved, way: Array) -> tuple[float, float, float]:
    """By how much unknowns are off in a direction (p,), what of that matters, and its sigma."""
    floors = np.array([fit.model.unknowns[i].floor for i in places])
    inside = at.covariance[np.ix_(list(places), list(places))]
    off = abs(float(way @ _off(fit, places, at)))
    return off, float(np.linalg.norm(way * floors)), math.sqrt(float(way @ inside @ way))


def _pruned(
    choices: Choices, chosen: list[str], untestable: Sequence[str], level: float
) -> tuple[list[str], dict[str, float]]:
    """Without those that are not needed any more, and what each of the others gains."""
    while True:
        every = [*chosen, *untestable]
        whole = choices.solved(every).chi2
        gains = {n: choices.solved([c for c in every if c != n]).chi2 - whole for n in chosen}
        needless = {}
        for n in chosen:
            others = [c for c in every if c != n and _needs(c, [k for k in chosen if k != n])]
            if not _passes(choices, others, n, gains[n], level):
                needless[n] = _counted(choices, others, n, gains[n])
        if not needless:
            return chosen, gains
        weakest = min(needless, key=lambda n: needless[n])
        chosen = _without(chosen, weakest)


def _without(chosen: Sequence[str], name: str) -> list[str]:
    """The others, as far as they do without it."""
    rest = [c for c in chosen if c != name]
    return [c for c in rest if _needs(c, rest)]


def _rivals(choices: Choices, chosen: Sequence[str], name: str) -> tuple[str, ...]:
    """Effects that are not taken in, and in its place would leave hardly more.

    Nor would what is there explain more beside them: else they explain something else.  Also of
    those that this flight could not have shown: that nobody knows their numbers is no reason why it
    should not be they.
    """
    whole = choices.solved(chosen).chi2
    rest = [c for c in chosen if c != name]
    out = []
    for n in choices.names:
        if n in chosen or not _needs(n, rest):
            continue
        instead = choices.solved([*rest, n]).chi2
        both = choices.solved([*rest, n, name]).chi2
        if instead - min(whole, both) < AMBIGUOUS:
            out.append(n)
    return tuple(out)


def _testable(fit: Fit, name: str) -> bool:
    """Whether the largest plausible size would have been seen, of one unknown or of all."""
    places = fit.model.indices(name)
    return not all(_untestable(fit, places)) or together_testable(fit, places) is not None


def _untestable(fit: Fit, places: Sequence[int]) -> list[bool]:
    """Of each unknown, whether the flight would not have shown it at the largest plausible size."""
    sigma, unknowns = fit.sigma, fit.model.unknowns
    return [TESTABLE * float(sigma[i]) >= unknowns[i].plausible for i in places]


def together_testable(fit: Fit, places: Sequence[int]) -> Array | None:
    """(p,) direction in which unknowns are testable together, where one alone is not.

    Gusts leave such (:mod:`onboard.core.vehicle.across`): the lift at one angle of attack, not what
    of it is its slope's.  None where there are no gusts, or nothing is known in that direction.
    """
    effect = fit.model.effect_of(places[0])
    if fit.turned is None or not effect.together or not any(_untestable(fit, places)):
        return None
    plausible = fit.model.plausible[list(places)]
    every = list(range(len(fit.theta)))
    known: Array = fit.covariance + fit.untold(fit.information, every)
    inside: Array = known[np.ix_(list(places), list(places))] / np.outer(plausible, plausible)
    variances, ways = np.linalg.eigh(inside)
    if TESTABLE * np.sqrt(variances[0]) >= 1.0:
        return None
    # The first of the unknowns tells the unit.
    way: Array = ways[:, 0] / plausible * (plausible[0] / ways[0, 0])
    return way
