"""An accelerometer that jumped twice: in its offset, its scale, or one of each.

A contact, or a mount, that gives way and comes back; a supply that sags and takes the scale along.
One jump alone explains little of that, and what it leaves looks like something slower.  So the two
are tried as one hypothesis, beside the rest of the catalogue: together they have to be no chance,
to hold on flight not fitted, and to do clearly better than what was chosen without them; of which
each has to be needed beside the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import inf
from typing import Final, TypeAlias

import numpy as np

from onboard.core.diagnosis.candidates import Candidate, accepted, believable
from onboard.core.diagnosis.companions import Companions
from onboard.core.diagnosis.effort import FURTHEST, SPACINGS_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import Choice, choose
from onboard.core.diagnosis.jumps import (
    alike,
    best_of,
    candidate_of,
    candidates_of,
    jump_near,
    jumps_anywhere,
    reach_of_scan,
    surprising,
)
from onboard.core.diagnosis.limits import CLEARLY, SCAN_S
from onboard.core.diagnosis.score import least
from onboard.core.diagnosis.selection import Fitter
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.scale_step import ScaleStep

Jump: TypeAlias = BiasStep | ScaleStep
TWO: Final = 2
"""Jumps that are asked as one hypothesis."""


def jumped_twice(
    full: Examination,
    testable: Sequence[Effect],
    choice: Choice,
    companions: Companions,
    imu: int,
) -> tuple[Examination, Choice] | None:
    """The flight with two jumps in the place of one, or of none; None: it had no two.

    What other accelerometers say of a jump is of a flight with one, so they are not asked for its
    size: both are told by the velocity.

    Args:
        full: the flight with every column, without jumps.
        testable: the catalogue.
        choice: what was chosen without a second one.
        companions: the accelerometers of the vehicle.
        imu: which of them is examined.
    """
    first = _first(choice, full.point.skew_from)
    offsets = None if first is None else _moments(full, choice, first)
    found: tuple[Examination, Choice] | None = None
    for _ in range(FURTHEST):
        if offsets is None:
            break
        jumps: list[Jump] = [*offsets, *(_of_scale(jump) for jump in offsets)]
        wide = Examination(full, [*testable, *jumps], t0=full.point.skew_from, start=full).tuned()
        made = wide.doubting()
        twice = _chosen(made, testable, choice, jumps)
        if not _better(made, choice, twice, jumps):
            break
        if found is not None and _misfit(twice) > _misfit(found[1]) - CLEARLY:
            break
        found = wide, twice
        twice.jump_from = choice.jump_from
        twice.common = _common(full, twice, offsets[0], companions.of(offsets[0], imu))
        offsets = _moved(full, wide, twice)
    return found


def _common(full: Examination, twice: Choice, first: BiasStep, own: BiasStep) -> BiasStep | None:
    """The first jump, if it is of the offset and rather one of all accelerometers."""
    if not any(c.columns is first for c in twice.chosen):
        return None
    return first if alike(full, first, own, twice.fitter.pool.variance) else None


def _misfit(choice: Choice) -> float:
    """Minus twice the log-likelihood of what was chosen, with the noise that was found."""
    fitter = choice.fitter
    return fitter.fit(choice.free, held_out=False).chi2 + fitter.sums.log_det


def _moved(full: Examination, wide: Examination, twice: Choice) -> tuple[BiasStep, ...] | None:
    """Moments of the jumps that were chosen by the noise that is left with them in the model.

    Each is looked for beside those of other moments.  None if none is another one than it was.
    """
    chosen = [c.columns for c in twice.chosen if isinstance(c.columns, BiasStep | ScaleStep)]
    at = {jump.moment: jump for jump in chosen}
    out = []
    for jump in at.values():
        others = [x for x in chosen if x.moment != jump.moment]
        t0 = full.point.skew_from
        beside = Examination(full, full.families, t0=t0, start=wide, carried=others).with_rows()
        out.append(jump_near(beside, (), jump.moment, SCAN_S))
    apart = zip(out, at.values(), strict=True)
    if not any(abs(new.moment - old.moment) > old.onset_sigma for new, old in apart):
        return None
    return tuple(out) if _apart(out) else (min(out, key=lambda jump: jump.onset_sigma),)


def _apart(jumps: Sequence[BiasStep]) -> bool:
    """Whether jumps are at two moments: what goes and comes back at once is a blow, and no jump."""
    sigma = float(np.hypot(jumps[0].onset_sigma, jumps[-1].onset_sigma))
    return abs(jumps[0].moment - jumps[-1].moment) > max(sigma, SPACINGS_S[-1])


def _first(choice: Choice, t0: float) -> Jump | None:
    """The jump that was chosen, or that was looked at; as nobody has seen it but the velocity."""
    chosen = [c.columns for c in choice.chosen if isinstance(c.columns, BiasStep | ScaleStep)]
    jump = chosen[0] if chosen else choice.tried
    if jump is None:
        return None
    of_offset = BiasStep(Origin(t0)).at(jump.moment, None, jump.onset_sigma)
    return _of_scale(of_offset) if isinstance(jump, ScaleStep) else of_offset


def _of_scale(jump: BiasStep) -> ScaleStep:
    """One of the scale at the same moment."""
    return ScaleStep(jump.origin).at(jump.moment, jump.onset_sigma)


def _moments(full: Examination, choice: Choice, first: Jump) -> tuple[BiasStep, ...] | None:
    """When there were jumps, as jumps of the offset; of one moment if both kinds were at once.

    None if there is nothing beside the first.
    """
    second = _second(full, first)
    if second is not None:
        beside = full.carrying(second, tuned=False)
        pair = jump_near(beside, (), first.moment, SCAN_S), second
        if _apart(pair):
            return pair
    if isinstance(first, ScaleStep):
        first = BiasStep(first.origin).at(first.moment, None, first.onset_sigma)
    return (first,) if _of_both_kinds(choice) else None


def _of_both_kinds(choice: Choice) -> bool:
    """Whether a jump of the other kind at the moment of the one that was chosen is no chance.

    By the velocity alone: whoever has seen that it jumped has been heard with the one.
    """
    fitter, free = choice.fitter, choice.free
    chosen = {type(c.columns) for c in choice.chosen if c.jump}
    others = [
        replace(c, witness=None)
        for c in choice.candidates
        if c.jump and c.columns is not None and type(c.columns) not in chosen
    ]
    if not chosen or not others:
        return False
    before = fitter.fit(free)
    after = [fitter.fit([*free, *c.index]) for c in others]
    scores = (c.score(fitter, before, fit) for c, fit in zip(others, after, strict=True))
    return max(scores) >= least()


def _second(full: Examination, first: Jump) -> BiasStep | None:
    """The jump that explains most beside another one, if that is no chance."""
    with_first = full.carrying(first, tuned=False)
    looked = surprising(with_first, jumps_anywhere(with_first), least())
    if not looked:
        return None
    return jump_near(with_first, (), best_of(looked).moment, reach_of_scan(looked))


def _chosen(
    made: Examination, testable: Sequence[Effect], choice: Choice, jumps: Sequence[Jump]
) -> Choice:
    """Selection that begins with the likeliest jumps, and errors of attitude that were chosen."""
    fitter = Fitter(made.all_blocks, made.model, made.absent)
    ours = set(made.indices_of([*testable, *jumps]))
    base = [i for i in range(made.model.size) if i not in ours]
    candidates = [c for f in (*testable, *jumps) for c in candidates_of(made, f)]
    attitude = [c.columns for c in choice.chosen if c.columns and c.columns.of_attitude]
    kept = [c for c in candidates if c.columns in attitude]
    pair = _likeliest(fitter, [*base, *(i for c in kept for i in c.index)], candidates)
    return choose(fitter, base, candidates, [*kept, *pair])


def _likeliest(
    fitter: Fitter, rest: Sequence[int], candidates: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """Of jumps at each moment one of a kind: the rarer one where it is clearly likelier."""
    at: dict[float, list[Candidate]] = {}
    for c in candidates:
        if c.jump and c.columns is not None and c.columns.onset is not None:
            at.setdefault(c.columns.onset, []).append(c)
    clearly = CLEARLY * max(fitter.pool.variance, 1.0)

    def misfit(some: Sequence[Candidate]) -> float:
        fit = fitter.fit([*rest, *(i for c in some for i in c.index)], held_out=False)
        wild = [c for c in some if c.rare and not believable(fitter, fit, c)]
        return inf if wild else fit.chi2 + clearly * sum(c.rare for c in some)

    return min(product(*at.values()), key=misfit)


def _better(made: Examination, before: Choice, twice: Choice, jumps: Sequence[Jump]) -> bool:
    """Whether two jumps are in a choice, each needed, and clearly better than what was before."""
    own = [c for c in twice.chosen if c.columns in jumps]
    if len(own) < TWO:
        return False
    fitter, free = twice.fitter, twice.free
    with_all = fitter.fit(free)
    for c in own:
        rest = [i for i in free if i not in c.index]
        if c.score(fitter, fitter.fit(rest), with_all) < least():
            return False
    pair = _as_one(own)
    rest = [i for i in free if i not in pair.index]
    if not accepted(fitter, fitter.fit(rest), with_all, pair):
        return False
    changing = _as_one([c for c in twice.chosen if _changes(c)])
    instead = [
        candidate_of(made, _same_as(c.columns, jumps))
        for c in before.chosen
        if _changes(c) and c.columns is not None
    ]
    if not instead:
        return True
    rest = [i for i in free if i not in changing.index]
    without = fitter.fit(rest)
    was = _as_one(instead)
    with_was = fitter.fit([*rest, *(i for i in was.index if i not in rest)])
    ours = changing.common_score(fitter, without, with_all)
    return ours > CLEARLY + was.common_score(fitter, without, with_was)


def _same_as(effect: Effect, jumps: Sequence[Jump]) -> Effect:
    """An effect of another choice among these columns: of a jump, the first of its kind."""
    return next((jump for jump in jumps if type(jump) is type(effect)), effect)


def _changes(c: Candidate) -> bool:
    """Whether it is a change of the offset in flight."""
    return c.jump or bool(c.columns and c.columns.tilts_ekf)


def _as_one(some: Sequence[Candidate]) -> Candidate:
    """Candidates as one hypothesis; of jumps each was looked for in as many places."""
    places = 1.0
    for c in some:
        places *= c.places
    return Candidate(
        BiasStep.effect,
        tuple(i for c in some for i in c.index),
        tuple(p for c in some for p in c.plausible),
        places=places,
        jump=True,
    )
