"""Which effects to accept: forward selection, with second thoughts, on sums alone.

An effect is taken when the fall of the misfit pays for its unknowns (BIC) by a wide margin, when it
holds on blocks of the flight that were not fitted, when its size is sure and believable, and
when it matters.  A jump of the offsets competes like the rest: at the starts of blocks as long
as its moment is not known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.candidates import Candidate, accepted, convincing
from onboard.core.diagnosis.limits import (
    CONTRADICTING,
    FAIR,
    LEAST_BLOCKS,
    LEFT_BESIDE,
    MARGIN,
    MOST_EFFECTS,
    RECONCILED,
    RIVAL_SHARE,
    SECOND_ORDER,
    STILL,
)
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.maths.arrays import Array
from onboard.core.physics.effects.bias_step import LARGEST, BiasStep
from onboard.core.physics.finding import Confounder


@dataclass(slots=True)
class Choice:
    """Effects that were taken, in order, and the sums in which they are columns.

    ``nothing`` is a fit without the effects that ``base`` holds.
    """

    fitter: Fitter
    base: list[int]
    candidates: list[Candidate]
    chosen: list[Candidate]
    nothing: Fit | None = None

    def least(self, now: Fit) -> float:
        """Evidence that is more than what was found already may have left over.

        Columns are linear in it, and those that follow a signal which is sampled now and then
        miss what that does in between.

        Args:
            now: fit of what was chosen.
        """
        if self.nothing is None:
            return MARGIN
        left = SECOND_ORDER * self.fitter.gain(self.nothing, now)
        for c in self.chosen:
            if c.unseen > 0.0:
                rest = [i for i in self.free if i not in c.index]
                without = self.fitter.fit(rest, held_out=False)
                left += c.unseen * self.fitter.gain(without, now)
        return max(MARGIN, left)

    @property
    def free(self) -> list[int]:
        """Columns of the model that was chosen."""
        return self.base + [i for c in self.chosen for i in c.index]

    def confounders(self, target: Candidate) -> list[Confounder]:
        """What else could stand in the place of a chosen effect, nearest first."""
        rest = self.base + [i for c in self.chosen if c is not target for i in c.index]
        others = [c for c in self.candidates if c not in self.chosen and c.effect != target.effect]
        step, boundary = _best_jump(self, rest)
        if step is None or boundary is None or target.columns is None:
            return confounders_of(self.fitter, rest, target, others)
        if not target.columns.tilts_ekf:
            return confounders_of(self.fitter, rest, target, others)
        # What wanders, on one flight, may have jumped.
        return confounders_of(self.fitter.stepped(boundary), rest, target, [*others, step])


def confounders_of(
    fitter: Fitter,
    rest: Sequence[int],
    target: Candidate,
    others: Sequence[Candidate],
    held: Array | None = None,
) -> list[Confounder]:
    """Others that explain, instead of ``target``, a good part of what it explains.

    Args:
        fitter: has the columns of all.
        rest: columns that are in the model anyway.
        target: the effect.
        others: what is compared with it.
        held: values of what is not in the model.
    """
    before = fitter.fit(rest, held, held_out=False)
    with_it = fitter.fit([*rest, *target.index], held, held_out=False)
    bic = target.bic(fitter, before, with_it)
    out = []
    for other in others:
        instead = fitter.fit([*rest, *other.index], held, held_out=False)
        gain = fitter.gain(before, instead)
        other_bic = other.bic(fitter, before, instead)
        if other_bic < max(RIVAL_SHARE * bic, 0.0):
            continue
        both = fitter.fit([*rest, *target.index, *other.index], held, held_out=False)
        if fitter.gain(with_it, both) < LEFT_BESIDE * gain:
            out.append(Confounder(other.effect, float(bic - other_bic)))
    nearest: dict[str, Confounder] = {}
    for confounder in sorted(out, key=lambda r: r.delta_bic):
        nearest.setdefault(confounder.name, confounder)
    return list(nearest.values())


def choose(
    fitter: Fitter,
    base: Sequence[int],
    candidates: Sequence[Candidate],
    nothing: Fit | None = None,
    kept: Sequence[Candidate] = (),
) -> Choice:
    """Forward selection, each time with a look back.

    Args:
        fitter: has the columns of all.
        base: columns that are in the model anyway.
        candidates: effects that may be taken.
        nothing: fit without the effects that ``base`` holds (a late attitude, a tilt).
        kept: candidates that are in the model to begin with.
    """
    choice = Choice(fitter, list(base), list(candidates), list(kept), nothing=nothing)
    while len(choice.chosen) < MOST_EFFECTS:
        step, boundary = _best_jump(choice, choice.free)
        offered = [c for c in choice.candidates if c not in choice.chosen]
        wide = choice.fitter
        if step is not None and boundary is not None:
            wide = choice.fitter.stepped(boundary)
            offered.append(step)
        before = wide.fit(choice.free)
        scored = []
        for c in offered:
            after = wide.fit([*choice.free, *c.index])
            scored.append((c.bic(wide, before, after), c, after))
        scored.sort(key=lambda s: -s[0])
        least = choice.least(before)
        fine = (
            c for bic, c, after in scored if bic >= least and accepted(wide, before, after, c, bic)
        )
        best = next(fine, None) or _reconciling(wide, choice.free, before, scored)
        if best is None:
            break
        if best is step:
            choice.fitter = wide
            choice.candidates.append(best)
        choice.chosen.append(best)
        _reconsider(choice)
    return choice


def reconsider_nuisance(choice: Choice, nuisances: Candidate, held: Array) -> bool:
    """Whether something else explains what is taken for an effect that is always in the model.

    Timing and constant attitude errors are estimated anyway, so they take what they can of a small
    effect beside them, which then looks too weak.  If one of the others does better *in their
    place*, it is taken, and they are asked again with it.

    Args:
        choice: what was chosen so far; the other is added to it.
        nuisances: the columns in question.
        held: (m,) values of what is not in the model.
    """
    fitter = choice.fitter
    rest = [i for i in choice.free if i not in nuisances.index]
    before = fitter.fit(rest, held)
    with_it = fitter.fit([*rest, *nuisances.index], held, held_out=False)
    own = nuisances.bic(fitter, before, with_it)
    better = own
    taken: Candidate | None = None
    for other in choice.candidates:
        if other in choice.chosen or other.effect == nuisances.effect:
            continue
        after = fitter.fit([*rest, *other.index], held)
        bic = other.bic(fitter, before, after)
        if bic > max(better, choice.least(before)) and accepted(fitter, before, after, other, bic):
            better, taken = bic, other
    if taken is None:
        return False
    choice.chosen.append(taken)
    return True


def doubtful(choice: Choice, value: Callable[[Fit], float], least: float) -> list[str]:
    """Effects beside any one of which a nuisances unknown would not reach the size of an effect.

    Args:
        choice: what was chosen.
        value: the unknown of a fit.
        least: size from which it counts.
    """
    out = []
    for other in choice.candidates:
        if other in choice.chosen:
            continue
        beside = choice.fitter.fit([*choice.free, *other.index], held_out=False)
        if abs(value(beside)) < STILL * least:
            out.append(other.effect)
    return out


def _best_jump(choice: Choice, beside: Sequence[int]) -> tuple[Candidate | None, int | None]:
    """The jump that would help most beside some columns, if there is none yet."""
    located = any(c.jump for c in choice.candidates)
    if located or len(choice.fitter.blocks) < LEAST_BLOCKS:
        return None, None
    jumps = choice.fitter.jumps(list(beside))
    if not jumps:
        return None, None
    boundary = max(jumps, key=lambda x: x[1])[0]
    m = choice.fitter.model.size
    index = (m, m + 1, m + 2)
    return Candidate(BiasStep.effect, index, (LARGEST,) * 3, spent=1, jump=True), boundary


def _reconsider(choice: Choice) -> None:
    """Drop what became insignificant, exchange what another one does better."""
    fitter = choice.fitter
    for c in list(choice.chosen[:-1]):
        rest = [i for i in choice.free if i not in c.index]
        before = fitter.fit(rest, held_out=False)
        bic = c.bic(fitter, before, fitter.fit([*rest, *c.index], held_out=False))
        if bic < MARGIN:
            choice.chosen.remove(c)
            continue
        swaps = []
        for offered in choice.candidates:
            if offered not in choice.chosen:
                instead = fitter.fit([*rest, *offered.index], held_out=False)
                swaps.append((offered.bic(fitter, before, instead), offered))
        better, other = max(swaps, key=lambda s: s[0], default=(-np.inf, c))
        if better > bic + MARGIN:
            whole = fitter.fit(rest), fitter.fit([*rest, *other.index])
            if accepted(fitter, *whole, other, better):
                choice.chosen[choice.chosen.index(c)] = other


def _reconciling(
    fitter: Fitter,
    free: Sequence[int],
    before: Fit,
    scored: Sequence[tuple[float, Candidate, Fit]],
) -> Candidate | None:
    """An effect of fair evidence with which blocks agree that contradict each other without."""
    if fitter.variance_inflation_of(free) < CONTRADICTING:
        return None
    for bic, c, after in scored:
        fair = bic > FAIR and convincing(fitter, before, after, c)
        if fair and reconciles(fitter, free, c.index):
            return c
    return None


def reconciles(fitter: Fitter, rest: Sequence[int], index: Sequence[int]) -> bool:
    """Whether blocks contradict each other without the columns ``index``, and agree with them."""
    apart = fitter.variance_inflation_of(rest)
    return (
        apart > CONTRADICTING and fitter.variance_inflation_of([*rest, *index]) < RECONCILED * apart
    )
