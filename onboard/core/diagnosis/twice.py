"""An offset that jumped twice: a contact, or a mount, that gives way and comes back.

One jump alone explains little of that, and what it leaves looks like something slower.  So the two
are tried as one hypothesis, beside the rest of the catalogue: together they have to be no chance,
to hold on flight not fitted, and to do clearly better than what was chosen without them; of which
each has to be needed beside the other.
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.diagnosis.candidates import Candidate, accepted
from onboard.core.diagnosis.companions import Companions
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import Choice, choose
from onboard.core.diagnosis.jumps import (
    alike,
    candidate_of,
    candidates_of,
    jump_near,
    jumps_anywhere,
    reach_of_scan,
)
from onboard.core.diagnosis.limits import CLEARLY, SCAN_S
from onboard.core.diagnosis.score import least, surprise
from onboard.core.diagnosis.selection import Fitter
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.scale_step import ScaleStep


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
    if first is None:
        return None
    second = _second(full, first)
    if second is None:
        return None
    first = jump_near(full.carrying(second, tuned=False), (), first.moment, SCAN_S)
    if first.name == second.name:
        return None
    wide = Examination(
        full, [*testable, first, second], t0=full.point.skew_from, start=full
    ).tuned()
    made = wide.doubting()
    twice = _chosen(made, testable, choice, (first, second))
    if not _better(made, choice, twice, (first, second)):
        return None
    twice.jump_from = choice.jump_from
    own = companions.of(first, imu)
    twice.common = first if alike(full, first, own, twice.fitter.pool.variance) else None
    return wide, twice


def _first(choice: Choice, t0: float) -> BiasStep | None:
    """The jump that was chosen, or that was looked at; as nobody has seen it but the velocity."""
    if any(isinstance(c.columns, ScaleStep) for c in choice.chosen):
        return None
    chosen = [c.columns for c in choice.chosen if isinstance(c.columns, BiasStep)]
    jump = chosen[0] if chosen else choice.tried
    return None if jump is None else BiasStep(Origin(t0)).at(jump.moment, None, jump.onset_sigma)


def _second(full: Examination, first: BiasStep) -> BiasStep | None:
    """The jump that explains most beside another one, if that is no chance."""
    with_first = full.carrying(first, tuned=False)
    looked = jumps_anywhere(with_first)
    if not looked:
        return None
    best = max(looked, key=lambda at: at.gain)
    if surprise(best.gain, 3, len(looked)) < least():
        return None
    return jump_near(with_first, (), best.moment, reach_of_scan(looked))


def _chosen(
    made: Examination, testable: Sequence[Effect], choice: Choice, jumps: Sequence[BiasStep]
) -> Choice:
    """Selection that begins with both jumps, and with errors of attitude that were chosen."""
    fitter = Fitter(made.all_blocks, made.model, made.absent)
    ours = set(made.indices_of([*testable, *jumps]))
    base = [i for i in range(made.model.size) if i not in ours]
    candidates = [c for f in (*testable, *jumps) for c in candidates_of(made, f)]
    attitude = [c.columns for c in choice.chosen if c.columns and c.columns.of_attitude]
    kept = [c for c in candidates if c.columns in [*attitude, *jumps]]
    return choose(fitter, base, candidates, kept)


def _better(
    made: Examination, before: Choice, twice: Choice, jumps: tuple[BiasStep, BiasStep]
) -> bool:
    """Whether both jumps are in a choice, needed, and clearly better than what was before."""
    own = [c for c in twice.chosen if c.columns in jumps]
    if len(own) < len(jumps):
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
        candidate_of(made, jumps[0] if isinstance(c.columns, BiasStep) else c.columns)
        for c in before.chosen
        if _changes(c) and c.columns is not None
    ]
    if not instead:
        return True
    rest = [i for i in free if i not in changing.index]
    without = fitter.fit(rest)
    was = _as_one(instead)
    with_was = fitter.fit([*rest, *(i for i in was.index if i not in rest)])
    return changing.score(fitter, without, with_all) > CLEARLY + was.score(
        fitter, without, with_was
    )


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
