"""From the effects that were chosen to the model that stands: about its sizes, nothing needless."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import Choice
from onboard.core.diagnosis.jumps import candidate_of
from onboard.core.diagnosis.limits import LINEAR_SHARE
from onboard.core.diagnosis.score import least
from onboard.core.diagnosis.search import searched
from onboard.core.diagnosis.selection import Fitter
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import Effect


def settled(
    full: Examination, choice: Choice, families: list[Effect], *, named_only: bool
) -> tuple[Examination, list[Effect]]:
    """The model that was chosen, until nothing in it is needless and nothing is left to find."""
    final = _final(full, choice, families)
    jumped = any(f.onset is not None for f in families)
    # Sizes that were chosen about nothing are not yet those that a jump, or a shape, leaves.
    if (jumped and any(f.in_proportion for f in families)) or any(f.shaped for f in families):
        found = final.found().theta - final.absent
        families = _about_sizes([(f, found[final.indices(f)]) for f in families])
        final = _again(full, families, final).with_rows()
    if any(f.taken_off is not None for f in families):
        # Noise that was found with a jump in the force is that of a bent flight, as are gates.
        t0 = full.point.skew_from
        final = Examination(full, families, t0=t0, start=final).with_noise()
    # A jump may have passed for something slower, or the other way round.
    final, families = _pruned(full, families, final)
    wider = families if named_only else searched(final, families)
    if wider != families:
        final = _again(full, wider, final).with_noise()
        final, families = _pruned(full, wider, final)
    return final, families


def opened(
    full: Examination, families: list[Effect], final: Examination
) -> tuple[Examination, list[Effect]]:
    """The model that stands with what the laws of its families leave open of the six."""
    wider = [f.opened() for f in families]
    if all(a is b for a, b in zip(wider, families, strict=True)):
        return final, families
    return only(full, wider, final)


def only(
    full: Examination, families: list[Effect], final: Examination
) -> tuple[Examination, list[Effect]]:
    """The model with no more than some of its families."""
    return _again(full, families, final).with_rows(), families


def _pruned(
    full: Examination, families: list[Effect], final: Examination
) -> tuple[Examination, list[Effect]]:
    """The model without families that are not needed beside the others."""
    kept = needed_beside(final, families)
    if len(kept) == len(families):
        return final, families
    return only(full, kept, final)


def families_of(choice: Choice) -> list[Effect]:
    """Columns of what was chosen; those of a gain about its size."""
    theta = choice.fitter.fit(choice.free, held_out=False).theta - choice.fitter.absent
    sized = [(c.columns, theta[list(c.index)]) for c in choice.chosen if c.columns is not None]
    return _about_sizes(sized)


def _about_sizes(sized: Sequence[tuple[Effect, Array]]) -> list[Effect]:
    """Effects of which those in proportion to the force act on the force without the others."""
    alone = [(f.about(size, ()), size) for f, size in sized]
    return [
        f.about(size, [a for j, a in enumerate(alone) if j != i and _bends(a[0])])
        for i, (f, size) in enumerate(alone)
    ]


def _bends(f: Effect) -> bool:
    """Whether samples have a force that it has changed."""
    return f.changes_force and f.taken_off is None


def _final(full: Examination, choice: Choice, families: Sequence[Effect]) -> Examination:
    """The model that was chosen, about what the sums of everything say of it."""
    model = choice.fitter.model
    fit = choice.fitter.fit(choice.free, held_out=False)
    known = choice.fitter.covariance(fit)
    final = Examination(
        full,
        families,
        t0=full.point.skew_from,
        start=full,
        point=full.asked(fit.theta, known, model),
        refused=full.refused_velocities(),
    )
    theta, covariance = final.model.taken_over(model, fit.theta, known)
    for f in families:
        if f.in_proportion:
            # A size about nothing is too large or too small by as much as the effect is of the
            # force; gates that believed it would leave out the flight that says so.
            index = final.indices(f)
            covariance[index, index] += (LINEAR_SHARE * theta[index]) ** 2
    return final.with_rows(final.about_point(theta), covariance)


def _again(full: Examination, families: Sequence[Effect], final: Examination) -> Examination:
    """Another model than the final one, from where that one has come to."""
    judged = final if any(f.taken_off is not None for f in families) else full
    return Examination(
        full,
        families,
        t0=full.point.skew_from,
        start=final,
        refused=judged.refused_velocities(),
    )


def needed_beside(made: Examination, families: Sequence[Effect]) -> list[Effect]:
    """Families that still count as found beside each other and all else that is in one model."""
    fitter = Fitter(made.all_blocks, made.model, made.absent)
    kept = list(families)
    base = [i for i in range(made.model.size) if i not in set(made.indices_of(families))]
    while kept:
        free = base + made.indices_of(kept)
        with_all = fitter.fit(free)
        worst, lowest = None, np.inf
        for family in kept:
            c = candidate_of(made, family)
            rest = [i for i in free if i not in c.index]
            score = c.score(fitter, fitter.fit(rest), with_all)
            if score < lowest:
                worst, lowest = family, score
        if lowest >= least():
            break
        kept = [f for f in kept if f is not worst]
    return kept
