"""Which physics the model left out of a recording: locate, decide, say.

The flight that a calibrator has kept goes once more through the filter with every column of the
catalogue; noise is estimated with all of them in, so that missing physics is not mistaken for
noise.  Selection is algebra on those sums; the final model is re-linearised and gives calibration,
timing and residuals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, log

from onboard.core.diagnosis.about_jumps import about_jumps
from onboard.core.diagnosis.borne_out import doubted
from onboard.core.diagnosis.cleared import Cleared, cleared, since_reboot, unused_of
from onboard.core.diagnosis.companions import Companion, Companions
from onboard.core.diagnosis.effort import FURTHEST, SEARCHED
from onboard.core.diagnosis.evidence import Evidence, Judge
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.given_up import GivenUp
from onboard.core.diagnosis.hypotheses import Choice, choose
from onboard.core.diagnosis.jumps import (
    alike,
    best_of,
    candidate_of,
    candidates_of,
    explains,
    halved,
    jump_near,
    jumps_anywhere,
    placed,
    reach_of_scan,
    shock_instead,
    shown_from,
    surprising,
)
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.nuisance_rivals import compared
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.diagnosis.refusals import believed
from onboard.core.diagnosis.score import least, surprise
from onboard.core.diagnosis.selection import Fitter
from onboard.core.diagnosis.settling import families_of, only, opened, settled
from onboard.core.diagnosis.shadows import without_shadows
from onboard.core.diagnosis.twice import jumped_twice
from onboard.core.diagnosis.wander import still_wanders, wandering
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.limits import FEWEST_BLOCKS
from onboard.core.inputs.clock_rates import most_growth
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.scale_step import ScaleStep


def diagnose(
    calibrator: Calibrator, imu: int, *, latest: bool = False, since: float = -inf
) -> Diagnosis:
    """Diagnose one accelerometer's recording: what :func:`examine` has found, as a record."""
    return examine(calibrator, imu, latest=latest, since=since).diagnosis()


def examine(
    calibrator: Calibrator,
    imu: int,
    *,
    latest: bool = False,
    since: float = -inf,
    beside: Examination | None = None,
) -> Judge:
    """Find the model of one accelerometer's recording; the calibrator is left as it is.

    Args:
        calibrator: finished; its settings' buffer must hold the flight of interest.
        imu: which accelerometer.
        latest: look only at what is kept since the boot clock last began; times are then since
            the first sample that is kept.
        since: with ``latest``: only what was flown from this time of that clock on, s.
        beside: another accelerometer of the same flight that has been examined, whose noise and
            timing are where this one's are looked for first; they end as its own.

    Raises:
        KeyError: that accelerometer has not been seen.
    """
    engine = calibrator.engine(imu)
    flight = since_reboot(engine.batches, since) if latest else list(engine.batches)
    origin = _origin(calibrator, imu, flight, latest=latest)
    clear = cleared(calibrator, engine, flight, origin, beside)
    companions = _companions(calibrator, imu, clear, latest=latest, since=since)
    asked = _Asked(clear.testable, companions, imu)
    stands = _modelled(clear.full, asked, origin, calibrator, named_only=clear.clipped)
    if not clear.clipped:
        clear, stands = _with_given_up(clear, stands, asked, origin, calibrator)
    # An EKF that followed false fixes comes back as slowly as an offset wanders.  What shakes near
    # the limit of its sensor is cut now and then, unseen, as manoeuvres come and go.
    if clear.fault is None and not clear.clipped:
        stands = _beside_wander(clear, stands, asked, origin, calibrator)
    about = about_jumps(stands.full, stands.choice, stands.final, stands.families)
    stands.final.claim(doubted(stands.final))
    return Judge(
        calibrator,
        imu,
        Evidence(
            full=stands.full,
            choice=stands.choice,
            about=about,
            final=stands.final,
            families=tuple(stands.families),
            doubts=stands.rivals,
            companions=companions,
            believed=believed(clear.sampled, calibrator.trust.refusals),
            unused=unused_of(clear, flight, calibrator, origin, stands.final),
            sampled=clear.as_sampled,
            clipped=clear.clipped,
            heard=clear.heard,
            blows=clear.blows,
            at_odds=clear.at_odds,
        ),
        origin,
        clear.absent,
        tuple(e for e in clear.seen if e is not None),
    )


@dataclass(frozen=True, slots=True)
class _Stands:
    """A model that was chosen: from which sums, beside what, and what could be said instead."""

    full: Examination
    choice: Choice
    rivals: Mapping[str, Sequence[str]]
    final: Examination
    families: list[Effect]


def _modelled(
    begun: Examination,
    asked: _Asked,
    origin: Origin,
    calibrator: Calibrator,
    *,
    named_only: bool,
) -> _Stands:
    """The model that a flight with every column of the catalogue asks for."""
    full, choice = _selected(begun, asked, origin)
    if full is not begun:
        begun.let_sums_go()
    rivals = compared(choice, full, calibrator, asked.imu)
    final, families = settled(full, choice, families_of(choice), named_only=named_only)
    steady = without_shadows(FinalModel(final, families, origin, calibrator.parameters))
    if len(steady) < len(families):
        final, families = only(full, steady, final)
    final, families = opened(full, families, final)
    return _Stands(full, choice, rivals, final, families)


def _with_given_up(
    clear: Cleared, stands: _Stands, asked: _Asked, origin: Origin, calibrator: Calibrator
) -> tuple[Cleared, _Stands]:
    """The flight and its model, with what the autopilot's filter gave up if it was wrong there.

    That is asked where velocities are far from the model, or an accelerometer is known to have
    jumped, which is what a filter complains of.
    """
    given_up = GivenUp(calibrator, clear, origin.t0)
    if not given_up:
        return clear, stands
    contradicted = given_up.contradicted(given_up.gone_through(stands.final))
    if not contradicted and all(f.onset is None for f in stands.families):
        return clear, stands
    with_all = given_up.believed(calibrator.engine(asked.imu))
    other = _modelled(with_all.full, asked, origin, calibrator, named_only=clear.clipped)
    contradicts = other.final.found().contradicts or any(not f.named for f in other.families)
    if contradicts or given_up.contradicted(other.final):
        return replace(clear, at_odds=contradicted), stands
    return replace(with_all, full=other.full), other


def _beside_wander(
    clear: Cleared, stands: _Stands, asked: _Asked, origin: Origin, calibrator: Calibrator
) -> _Stands:
    """The model with an offset that wanders, if it does.

    What was chosen without it is chosen anew where it does not stand, or does not explain all.
    """
    parameters = calibrator.parameters
    found = wandering(stands.full, stands.families, stands.final, origin, parameters)
    if found is None:
        return stands
    families = [*found.kept, found.wander]
    if found.settled:
        return replace(stands, final=found.made, families=families)
    full = stands.full.carrying(found.wander, tuned=False)
    other = _modelled(full, asked, origin, calibrator, named_only=clear.clipped)
    if not still_wanders(other.final, found.wander):
        return stands
    return replace(other, families=[*other.families, found.wander])


def _origin(calibrator: Calibrator, imu: int, flight: Sequence[Batch], *, latest: bool) -> Origin:
    """What effects count from: the first sample of all, or that of the ``latest`` flight."""
    x, y, z = (float(a) for a in calibrator.parameters.antenna)
    return Origin(
        t0=float(flight[0].segment.t[0]) if latest and flight else calibrator.first_sample,
        antenna=(x, y, z),
        trim=calibrator.parameters.trim,
        imu=imu,
        receiver=calibrator.parameters.receiver,
        latency_growth=most_growth(since_reboot(flight)),
    )


def _companions(
    calibrator: Calibrator, imu: int, clear: Cleared, *, latest: bool, since: float
) -> Companions:
    """All accelerometers of the vehicle; of this one what is examined.

    Where the clock began anew within the flight, none: a moment of it is no one moment.
    """
    if len(since_reboot(clear.sampled)) < len(clear.sampled):
        return Companions({})
    prior = clear.full.model.prior_sigma[:6]
    everyone = {}
    for other, batches in calibrator.flown.items():
        theirs = since_reboot(batches, since) if latest else batches
        own = clear.sampled if other == imu else theirs
        before = calibrator.parameters.six(other).as_linear()
        everyone[other] = Companion(own, before, prior)
    return Companions(everyone)


@dataclass(frozen=True, slots=True)
class _Asked:
    """What is asked of a flight: its effects, and the accelerometers beside the one examined."""

    testable: Sequence[Effect]
    companions: Companions
    imu: int


def _selected(full: Examination, asked: _Asked, origin: Origin) -> tuple[Examination, Choice]:
    """Effects by their scores, a jump among them if there is one; and the sums that say so."""
    choice = _chosen(full, asked.testable)
    seen, undecided = asked.companions.jump(asked.imu, origin), None
    if seen is not None:
        seen = placed(full, seen)
        wide, other = _beside(full, asked.testable, choice, seen)
        if any(c.jump for c in other.chosen):
            return _twice(full, asked, _likelier(full, asked, choice, (wide, other)))
        if _nobodys(wide, other, seen):
            undecided, full = seen, full.carrying(halved(seen))
            choice = _chosen(full, asked.testable)
    wide, choice = _by_gps(full, asked, choice)
    choice.undecided = undecided
    return (wide, choice) if undecided else _twice(full, asked, (wide, choice))


def _twice(
    full: Examination, asked: _Asked, found: tuple[Examination, Choice]
) -> tuple[Examination, Choice]:
    """What was found, or two jumps if the flight had two."""
    two = jumped_twice(full, asked.testable, found[1], asked.companions, asked.imu)
    return found if two is None else two


def _likelier(
    full: Examination, asked: _Asked, choice: Choice, seen: tuple[Examination, Choice]
) -> tuple[Examination, Choice]:
    """What was chosen with a jump that others have ``seen``, or with one that the velocity shows.

    Others see best what they differ by all at once; a velocity may show another jump by far more.
    """
    wide, other = _by_gps(full, asked, choice)
    return (wide, other) if _by_jump(other) > _by_jump(seen[1]) + CLEARLY else seen


def _by_jump(choice: Choice) -> float:
    """How surprising by chance what a jump explains beside all else; minus infinity of none."""
    fitter, scores = choice.fitter, [-inf]
    for c in (c for c in choice.chosen if c.jump):
        rest = [i for i in choice.free if i not in c.index]
        scores.append(c.common_score(fitter, fitter.fit(rest), fitter.fit(choice.free)))
    return max(scores)


def _by_gps(full: Examination, asked: _Asked, choice: Choice) -> tuple[Examination, Choice]:
    """The same of jumps that the velocity shows."""
    for _ in range(FURTHEST):
        jump = _jump(full, choice, asked)
        if jump is None:
            break
        shock = shock_instead(full, jump)
        if shock is None:
            own = asked.companions.of(jump, asked.imu)
            common = alike(full, jump, own, choice.fitter.pool.variance)
            wide, other = _with_jump(full, asked.testable, choice, jump if common else own)
            other.common = jump if common and any(c.columns is jump for c in other.chosen) else None
            other.tried = jump
            return wide, other
        known = any(shock.name == f.name for f in full.carried)
        if known or not explains(full, _steady(choice), shock):
            break
        full = full.carrying(shock)
        choice = _chosen(full, asked.testable)
    return full, choice


def _nobodys(wide: Examination, choice: Choice, seen: BiasStep) -> bool:
    """Whether a jump that is no chance is neither clearly of this accelerometer nor of another."""
    on_trial = candidate_of(wide, seen)
    if seen.witness is None or surprise(seen.witness.gain, 3, seen.witness.places) < least():
        return False
    fitter, free = choice.fitter, choice.free
    margin = on_trial.margin(fitter, fitter.fit(free), fitter.fit([*free, *on_trial.index]))
    return abs(margin) <= CLEARLY


def _with_jump(
    full: Examination, testable: Sequence[Effect], choice: Choice, jump: BiasStep
) -> tuple[Examination, Choice]:
    """Effects with a jump among those that are compared, if the offset changes at all."""
    wide, other = _beside(full, testable, choice, jump)
    return (wide, other) if _wanders(choice) or _wanders(other) else (full, choice)


def _beside(
    full: Examination, testable: Sequence[Effect], choice: Choice, jump: BiasStep
) -> tuple[Examination, Choice]:
    """Effects with a jump of the offset, or of the scale, among those that are compared."""
    scale = ScaleStep(jump.origin).at(jump.moment, jump.onset_sigma, jump.witness)
    everything = [*testable, jump, scale]
    wide = Examination(full, everything, t0=full.point.skew_from, start=full).tuned()
    # Which change of the offset it is must not be decided by an attitude that it has tilted.
    kept = [c.columns for c in choice.chosen if c.columns and c.columns.of_attitude]
    other = _chosen(wide.doubting(), everything, kept)
    other.jump_from = choice.jump_from
    return wide, other


def _jump(full: Examination, choice: Choice, asked: _Asked) -> BiasStep | None:
    """The jump that explains most by itself; None if nothing looks like one.

    Noise is estimated with every column of the catalogue in, so that nothing that is missing passes
    for noise; a jump is no column until its moment is known.  It is looked for beside nothing else:
    something with unknowns enough may have stood in for it.  Only what was chosen beside one has
    not, and may move it: axes that are not square make up for a jump at another moment.
    """
    if len(full.blocks) < FEWEST_BLOCKS:
        return None
    looked = jumps_anywhere(full)
    choice.jump_from = shown_from(full, looked, choice.fitter.pool, asked.companions, asked.imu)
    looked = surprising(full, looked, -inf if _wanders(choice) else -2.0 * log(SEARCHED))
    if not looked:
        return None
    jump = jump_near(full, (), best_of(looked).moment, reach_of_scan(looked))
    beside = _steady(choice)
    if beside and any(c.jump for c in choice.chosen):
        jump = jump_near(full, beside, jump.moment, reach_of_scan(looked))
    return jump


def _steady(choice: Choice) -> list[Effect]:
    """What was chosen that is no change of the offset."""
    return [c.columns for c in choice.chosen if c.columns and not c.columns.tilts_ekf]


def _wanders(choice: Choice) -> bool:
    """Whether the offset changes in flight."""
    return any(c.jump or (c.columns and c.columns.tilts_ekf) for c in choice.chosen)


def _chosen(
    full: Examination,
    testable: Sequence[Effect],
    kept: Sequence[Effect] = (),
) -> Choice:
    """Selection on the sums of the whole catalogue; ``kept`` are in it to begin with."""
    fitter = Fitter(full.all_blocks, full.model, full.absent)
    effects = set(full.indices_of(testable))
    base = [i for i in range(full.model.size) if i not in effects]
    candidates = [c for family in testable for c in candidates_of(full, family)]
    return choose(fitter, base, candidates, [c for c in candidates if c.columns in kept])
