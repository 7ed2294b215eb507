"""Which effects to accept: forward and backward steps by one score, on sums alone.

An effect is taken when what it explains is no chance, when it predicts flight that was not fitted,
when its size is believable, and when it matters.  A jump of the offsets competes like the rest: at
the starts of blocks as long as its moment is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from onboard.core.diagnosis.block_jumps import jumps_of_blocks, stepped
from onboard.core.diagnosis.candidates import Candidate, accepted, believable, possible
from onboard.core.diagnosis.effort import MOST_EFFECTS
from onboard.core.diagnosis.forms import score_in_best_form
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.score import least, surprise
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.limits import FEWEST_BLOCKS
from onboard.core.maths.arrays import Array
from onboard.core.physics.effects.bias_step import LARGEST, BiasStep, Witness
from onboard.core.physics.finding import Confounder


@dataclass(slots=True)
class Choice:
    """Effects that were taken, in order, and the sums in which they are columns.

    ``jump_from`` (3,) are sizes from which a jump would have been found at half of the moments at
    which it was looked for; None where it was not.  ``common`` is a jump that all accelerometers of
    the vehicle have made alike, ``undecided`` one that this one has made or another, ``tried`` one
    that was compared with the rest, chosen or not.
    """

    fitter: Fitter
    base: list[int]
    candidates: list[Candidate]
    chosen: list[Candidate]
    jump_from: Array | None = None
    common: BiasStep | None = None
    undecided: BiasStep | None = None
    tried: BiasStep | None = None

    @property
    def free(self) -> list[int]:
        """Columns of the model that was chosen."""
        return self.base + [i for c in self.chosen for i in c.index]

    def besides(self, taken: Sequence[Candidate]) -> list[Candidate]:
        """Candidates that may be taken beside some others.

        No simpler form of them is in, and what other accelerometers have seen of a jump is evidence
        once, whatever it is that jumped.
        """
        free = self.base + [i for c in taken for i in c.index]
        witnessed = any(c.witness is not None for c in taken)
        return [
            c
            for c in self.candidates
            if c.new_beside(free) and not (witnessed and c.witness is not None)
        ]

    def confounders(self, target: Candidate) -> list[Confounder]:
        """What else could stand in the place of a chosen effect, nearest first."""
        kept = [c for c in self.chosen if c is not target]
        rest = self.base + [i for c in kept for i in c.index]
        others = [c for c in self.besides(kept) if c is not target and c.effect != target.effect]
        step, wide = _with_best_jump(self, rest)
        if step is None or target.columns is None or not target.columns.tilts_ekf:
            return confounders_of(self.fitter, rest, target, others)
        # What wanders, on one flight, may have jumped.
        return confounders_of(wide, rest, target, [*others, step])


def confounders_of(
    fitter: Fitter,
    rest: Sequence[int],
    target: Candidate,
    others: Sequence[Candidate],
    held: Array | None = None,
) -> list[Confounder]:
    """Others that would count as found instead of ``target``, and do not beside it.

    Args:
        fitter: has the columns of all.
        rest: columns that are in the model anyway.
        target: the effect.
        others: what is compared with it.
        held: values of what is not in the model.
    """
    before = fitter.fit(rest, held, held_out=False)
    with_it = fitter.fit([*rest, *target.index], held, held_out=False)
    own = score_in_best_form(fitter, before, with_it, target, held)
    nearest: dict[str, Confounder] = {}
    for other in (o for o in others if o.new_beside(rest)):
        instead = fitter.fit([*rest, *other.index], held, held_out=False)
        found = other.score(fitter, before, instead) >= least()
        if not found or not possible(fitter, instead, other):
            continue
        both = fitter.fit([*rest, *target.index, *other.index], held, held_out=False)
        if other.score(fitter, with_it, both) >= least():
            continue
        behind = own - score_in_best_form(fitter, before, instead, other, held)
        if other.effect not in nearest or behind < nearest[other.effect].delta_bic:
            nearest[other.effect] = Confounder(other.effect, behind)
    return sorted(nearest.values(), key=lambda c: c.delta_bic)


def choose(
    fitter: Fitter,
    base: Sequence[int],
    candidates: Sequence[Candidate],
    kept: Sequence[Candidate] = (),
) -> Choice:
    """Forward selection, each time with a look back.

    Args:
        fitter: has the columns of all.
        base: columns that are in the model anyway.
        candidates: effects that may be taken.
        kept: candidates that are in the model to begin with.
    """
    choice = Choice(fitter, list(base), list(candidates), list(kept))
    while len(choice.chosen) < MOST_EFFECTS:
        step, wide = _with_best_jump(choice, choice.free)
        offered = choice.besides(choice.chosen) + ([step] if step is not None else [])
        offered = _in_question(wide, choice.free, offered)
        before = wide.fit(choice.free)
        best, most = None, -inf
        for c in offered:
            after = wide.fit([*choice.free, *c.index])
            if accepted(wide, before, after, c):
                better = c.merit(wide, before, after)
                best, most = (c, better) if better > most else (best, most)
        if best is None:
            break
        if best is step:
            choice.fitter = wide
            choice.candidates.append(best)
        choice.chosen.append(best)
        _reconsider(choice)
    _simplify(choice)
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
    better = nuisances.common_score(fitter, before, with_it)
    taken: Candidate | None = None
    for other in choice.besides(choice.chosen):
        if other.effect == nuisances.effect:
            continue
        after = fitter.fit([*rest, *other.index], held)
        its = other.common_score(fitter, before, after)
        if its > better and accepted(fitter, before, after, other):
            better, taken = its, other
    if taken is None:
        return False
    choice.chosen.append(taken)
    return True


def _with_best_jump(choice: Choice, beside: Sequence[int]) -> tuple[Candidate | None, Fitter]:
    """The jump that would help most beside some columns, if there is none yet; sums with it."""
    fitter = choice.fitter
    located = any(c.jump for c in choice.candidates)
    if located or len(fitter.blocks) < FEWEST_BLOCKS:
        return None, fitter
    jumps = jumps_of_blocks(fitter, list(beside))
    if not jumps:
        return None, fitter
    boundary = max(jumps, key=lambda x: x[1])[0]
    m = fitter.model.size
    step = Candidate(
        BiasStep.effect, (m, m + 1, m + 2), (LARGEST,) * 3, places=len(jumps), jump=True
    )
    return step, stepped(fitter, boundary)


def _in_question(
    fitter: Fitter, beside: Sequence[int], offered: Sequence[Candidate]
) -> list[Candidate]:
    """Candidates that no likelier or simpler one stands for."""
    return _no_needless_curves(fitter, beside, _likelier_jumps(fitter, beside, offered))


def _no_needless_curves(
    fitter: Fitter, beside: Sequence[int], offered: Sequence[Candidate]
) -> list[Candidate]:
    """Candidates without curves that explain no more than chance beyond what has fewer unknowns.

    That may be a simpler form of theirs, or another change of the offset: while a sensor warms up,
    whatever goes with time is some curve over its temperature.
    """
    simple = [c for c in offered if c.jump or (c.columns and c.columns.tilts_ekf)]
    bent = [c for c in simple if any(set(o.index) < set(c.index) for o in simple)]
    if not bent:
        return list(offered)
    chi2 = [fitter.fit([*beside, *c.index], held_out=False).chi2 for c in simple]
    variance = max(fitter.pool.variance, 1.0)

    def needed(c: Candidate) -> bool:
        own = chi2[simple.index(c)]
        more = [(x - own, len(c.index) - len(o.index)) for o, x in zip(simple, chi2, strict=True)]
        return all(surprise(by, k, variance=variance) >= least() for by, k in more if k > 0)

    return [c for c in offered if c not in bent or needed(c)]


def _likelier_jumps(
    fitter: Fitter, beside: Sequence[int], offered: Sequence[Candidate]
) -> list[Candidate]:
    """Candidates without those jumps that are less likely than others at the same moment.

    They have as many unknowns each, so their misfits are compared: scores of what is so large are
    of the scatter along each one's own columns.  The rarer kind has to be clearly likelier, and to
    be of a size that can be: a scale that loses most of itself takes whatever else is wrong, and
    stands for no jump.
    """
    fits = [(c, fitter.fit([*beside, *c.index], held_out=False)) for c in offered if c.jump]
    rare = [(c, fit) for c, fit in fits if c.rare and believable(fitter, fit, c)]
    usual = [(c, fit) for c, fit in fits if not c.rare]
    if not rare or not usual:
        return list(offered)
    least_rare, least_usual = (min(fit.chi2 for _, fit in some) for some in (rare, usual))
    clearly = least_usual - least_rare > CLEARLY * max(fitter.pool.variance, 1.0)
    gone = [c for c, _ in (usual if clearly else rare)]
    return [c for c in offered if c not in gone]


def _reconsider(choice: Choice) -> None:
    """Drop what is no longer needed, exchange what another one does clearly better."""
    fitter = choice.fitter
    for c in list(choice.chosen[:-1]):
        rest = [i for i in choice.free if i not in c.index]
        before = fitter.fit(rest)
        with_it = fitter.fit([*rest, *c.index])
        if c.score(fitter, before, with_it) < least():
            choice.chosen.remove(c)
            continue
        better, most = c, c.merit(fitter, before, with_it) + CLEARLY
        others = choice.besides([o for o in choice.chosen if o is not c])
        for other in _in_question(fitter, rest, [c, *(o for o in others if o is not c)]):
            if other is not c:
                after = fitter.fit([*rest, *other.index])
                its = other.merit(fitter, before, after)
                if its > most and accepted(fitter, before, after, other):
                    better, most = other, its
        choice.chosen[choice.chosen.index(c)] = better


def _simplify(choice: Choice) -> None:
    """Exchange what does nothing that matters beside an effect that it has room for.

    Axes that are not square have room for a tilt and for what an EKF makes of it: their numbers
    beyond the tilt are no chance on a quiet plane, and change nothing.
    """
    fitter = choice.fitter
    for c in list(choice.chosen):
        rest = [i for i in choice.free if i not in c.index]
        before = fitter.fit(rest)
        better: Candidate | None = None
        most = least()
        for other in choice.besides([o for o in choice.chosen if o is not c]):
            if other.effect not in c.room_for:
                continue
            instead = fitter.fit([*rest, *other.index])
            score = other.score(fitter, before, instead)
            if score < most or not accepted(fitter, before, instead, other):
                continue
            both = fitter.fit([*rest, *other.index, *c.index])
            if not accepted(fitter, instead, both, c):
                better, most = other, score
        if better is not None:
            choice.chosen[choice.chosen.index(c)] = better


def _counts(witness: Witness, claimed: Array) -> bool:
    """Whether half of a jump is most of what is not known of an offset, (3,) variances."""
    return bool(np.any((0.5 * witness.size) ** 2 > 0.5 * claimed))


def of_others(choice: Choice, t0: float, claimed: Array) -> str:
    """What the other accelerometers say of a jump, if that is not the sensor's alone.

    Args:
        choice: what was chosen.
        t0: what times are said from, s on the boot clock.
        claimed: (6,) variances of the six: one that nobody knows whose it is matters where most of
            an offset's is about it.
    """
    jump = choice.undecided
    if jump is not None and jump.witness is not None and _counts(jump.witness, claimed[3:]):
        by = zip("xyz", jump.witness.size.tolist(), strict=True)
        size = ", ".join(f"{axis} {x:+.2f}" for axis, x in by)
        return (
            f"At {jump.moment - t0:.0f} s this accelerometer jumped ({size} m/s^2) or another one "
            "by the opposite; the flight does not tell which, and the sigmas include both."
        )
    if (jump := choice.common) is not None:
        return (
            f"At {jump.moment - t0:.0f} s all accelerometers ask for the same jump: rather "
            "something that they share (GPS, the recorded attitude, a blow) than a sensor."
        )
    return ""
