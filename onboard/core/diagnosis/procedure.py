"""Which physics the model left out of a recording: locate, decide, say.

The flight that a calibrator has kept goes once more through the filter with every column of the
catalogue; noise is estimated with all of them in, so that missing physics is not mistaken for
noise.  Selection is algebra on those sums; the final model is re-linearised and gives calibration,
timing and residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.clipping import saturation_effect
from onboard.core.diagnosis.evidence import Evidence, Judge
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import (
    CONTRADICTING,
    FAIR,
    LEAST_BLOCKS,
    MARGIN,
    RECONCILED,
    Candidate,
    Choice,
    choose,
    doubtful,
    reconciles,
    reconsider_standing,
)
from onboard.core.diagnosis.jumps import boundary_of, candidate_of, jump_near
from onboard.core.diagnosis.records import Diagnosis, NotTestable
from onboard.core.diagnosis.refusals import believed, unused_flight
from onboard.core.diagnosis.screening import false_fixes, unclipped
from onboard.core.diagnosis.search import searched
from onboard.core.diagnosis.selection import Fitter
from onboard.core.diagnosis.standing import (
    Measured,
    attitude_unknowns,
    reduced,
    standing_effects,
    standing_kinds,
    without,
)
from onboard.core.diagnosis.testability import testable_of, unseen_share
from onboard.core.estimate.calibration_model import moved
from onboard.core.estimate.calibration_record import timing_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.estimate.solution import Solution, solve
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Effect, Origin, Standing
from onboard.core.physics.finding import Finding

ENOUGH = 0.3
"""Share of a flight that has to be left without what is clipped."""
SUSPECT = 18.0
"""Fall of chi-square by a jump at any block's start that one flight of thirty shows by chance."""


def diagnose(calibrator: Calibrator, imu: int, *, latest: bool = False) -> Diagnosis:
    """Diagnose one accelerometer's recording: what :func:`examine` has found, as a record."""
    return examine(calibrator, imu, latest=latest).diagnosis()


def examine(calibrator: Calibrator, imu: int, *, latest: bool = False) -> Judge:
    """Find the model of one accelerometer's recording; the calibrator is left as it is.

    Args:
        calibrator: finished; its settings' buffer must hold the flight of interest.
        imu: which accelerometer.
        latest: look only at what is kept since the boot clock last began; times are then since
            the first sample that is kept.

    Raises:
        KeyError: that accelerometer has not been seen.
    """
    engine = calibrator.engine(imu)
    flight = since_reboot(engine.batches) if latest else list(engine.batches)
    first = float(flight[0].segment.t[0]) if latest and flight else calibrator.first_sample
    antenna = calibrator.parameters.antenna
    origin = Origin(
        t0=first,
        antenna=(float(antenna[0]), float(antenna[1]), float(antenna[2])),
        trim=calibrator.parameters.trim,
        imu=imu,
    )
    rail = saturation_effect(flight, origin.t0, imu)
    batches = flight
    if rail is not None:
        batches = unclipped(batches, rail.intervals, origin.t0)
        if sum(c.trusted_s for c in batches) < ENOUGH * sum(c.trusted_s for c in flight):
            # Clipped all the time: what is left would say less than what is spoiled.
            batches = flight
    testable, absent = testable_of(catalogue(origin), batches)
    if rail is not None:
        absent += [NotTestable(f.effect, why) for f in testable if (why := f.bent_by_clipping)]
        testable = [f for f in testable if not f.bent_by_clipping]
    full = Examination(engine, testable, t0=origin.t0, batches=batches).with_noise()
    clipped = rail is not None and batches is flight
    fault: Finding | None = None
    if not clipped:
        # Of an accelerometer that clips all the time, nobody can say whether a fix is true.
        fault, batches = false_fixes(calibrator, engine, full, origin.t0)
    if fault is not None:
        full = Examination(engine, testable, t0=origin.t0, batches=batches).with_noise()
    full.doubting_attitude()
    choice = _chosen(full, testable)
    jumped = _with_jump(full, testable, choice)
    if jumped is not None:
        # Which change of the offset it is must not be decided by an attitude that it has tilted.
        kept = [c.columns for c in choice.chosen if c.columns and c.columns.of_attitude]
        other = _chosen(jumped[0].doubting(), jumped[1], kept)
        if _wanders(choice) or _wanders(other):
            full, testable, choice = *jumped, other
    standing, doubts = _second_thoughts(choice, full, calibrator, imu)
    families = _families(choice)
    if "gps_smoothing" in standing and "gps_smoothing" not in doubts:
        families = [f.averaged() for f in families]
    final = _final(full, choice, families).doubting_attitude()
    if any(f.onset is not None for f in families) and any(f.in_proportion for f in families):
        found = final.found().theta
        families = _about_sizes([(f, found[final.indices(f)]) for f in families])
        final = _again(full, families, final).with_rows().doubting_attitude()
    kept = _needed(final, families)
    if len(kept) < len(families):
        # A jump may have passed for something slower, or the other way round.
        families = kept
        final = _again(full, families, final).with_rows().doubting_attitude()
    wider = families if clipped else searched(final, families, choice.fitter.variance_inflation)
    if wider != families:
        families = wider
        final = _again(full, families, final).with_noise().doubting_attitude()
        kept = _needed(final, families)
        if len(kept) < len(families):
            families = kept
            final = _again(full, families, final).with_rows().doubting_attitude()
    unused = unused_flight(flight, calibrator.trust.refusals, fault, origin.t0, asked=not clipped)
    return Judge(
        calibrator,
        imu,
        Evidence(full, choice, final, tuple(families), doubts, believed(flight), unused),
        origin,
        absent,
        tuple(e for e in (rail, fault) if e is not None),
    )


def since_reboot(batches: Sequence[Batch]) -> list[Batch]:
    """The batches at the end whose clock is one and the same."""
    first = 0
    for i in range(1, len(batches)):
        if batches[i].fixes.t[0] < batches[i - 1].fixes.t[0]:
            first = i
    return list(batches[first:])


def _with_jump(
    full: Examination, testable: Sequence[Effect], choice: Choice
) -> tuple[Examination, list[Effect]] | None:
    """The same with a jump among the columns; None if nothing looks like one.

    Noise is estimated with every column of the catalogue in, so that nothing that is missing passes
    for noise; a jump is no column until its moment is known, and at a block's start, seconds
    away, it explains little of what it does.
    """
    steady = [c.columns for c in choice.chosen if c.columns and not c.columns.tilts_ekf]
    fitter = Fitter(full.all_blocks, full.model, 1.0, full.absent)
    jumps = fitter.jumps([*choice.base, *full.indices_of(steady)])
    if len(fitter.blocks) < LEAST_BLOCKS or not jumps:
        return None
    boundary, gain = max(jumps, key=lambda x: x[1])
    apart = full.found().variance_inflation
    likely = _wanders(choice) or gain > SUSPECT
    if not likely and apart < CONTRADICTING:
        return None
    everything = [*testable, jump_near(full, steady, boundary_of(fitter, boundary))]
    made = Examination(full, everything, t0=full.point.skew_from, start=full)
    if likely:
        return made.tuned(), everything
    agrees = made.with_noise().found().variance_inflation < RECONCILED * apart
    return (made, everything) if agrees else None


def _wanders(choice: Choice) -> bool:
    """Whether the offset changes in flight."""
    return any(c.jump or (c.columns and c.columns.tilts_ekf) for c in choice.chosen)


def _chosen(
    full: Examination,
    testable: Sequence[Effect],
    kept: Sequence[Effect] = (),
) -> Choice:
    """Selection on the sums of the whole catalogue; ``kept`` are in it to begin with."""
    solution = full.found()
    fitter = Fitter(full.all_blocks, full.model, solution.variance_inflation, full.absent)
    located = any(c.onset is not None for c in testable)
    jumps = [] if located else fitter.jumps(list(range(full.model.size)))
    if jumps and len(fitter.blocks) >= LEAST_BLOCKS:
        # Blocks that contradict each other because of a jump are no reason to doubt the jump.
        wide = fitter.stepped(max(jumps, key=lambda x: x[1])[0])
        fitter.variance_inflation = min(
            fitter.variance_inflation, solve(wide.blocks, wide.model).variance_inflation
        )
    effects = set(full.indices_of(testable))
    base = [i for i in range(full.model.size) if i not in effects]
    unseen = {name: unseen_share(full.batches, name) for c in testable for name in c.needs}
    candidates = [
        replace(candidate_of(full, c), unseen=max((unseen[name] for name in c.needs), default=0.0))
        for c in testable
    ]
    index = full.model.index
    errors = attitude_unknowns()
    held = without(errors, index, full.point, full.absent, told=0.0)
    gone = {index[c] for c in errors}
    nothing = fitter.fit([i for i in base if i not in gone], held, held_out=False)
    return choose(fitter, base, candidates, nothing, [c for c in candidates if c.columns in kept])


def _second_thoughts(
    choice: Choice, full: Examination, calibrator: Calibrator, imu: int
) -> tuple[set[str], dict[str, list[str]]]:
    """Timing and attitude errors that would be reported must be better than any other cause.

    Returns:
        Those that are large enough; of them, those beside which another effect could stand.
    """
    clock = fix_clock(calibrator.parameters, full.batches)
    told = clock.configured_on_stamp
    index = choice.fitter.model.index
    standing: Measured = {}
    unknowns = {name: kind.in_every_model for name, kind in standing_kinds().items()}
    for _ in range(len(unknowns)):
        fit = choice.fitter.fit(choice.free, held_out=False)
        solution = Solution(
            fit.theta,
            fit.covariance,
            choice.fitter.sums.N,
            choice.fitter.variance_inflation,
            1.0,
            1.0,
        )
        standing = standing_effects(
            Standing(
                timing=timing_of(full, solution),
                theta=solution.theta,
                sigma=np.sqrt(np.diag(solution.covariance)),
                index=index,
                point=full.point,
                parameters=calibrator.parameters,
                imu=imu,
                clock=clock,
            )
        )
        taken = False
        for name in standing:
            target = Candidate(name, tuple(index[c] for c in unknowns[name]), ())
            held = without(unknowns[name], index, full.point, choice.fitter.absent, told)
            taken = taken or reconsider_standing(choice, target, held)
        if not taken:
            break
    timed = [name for name in standing if standing_kinds()[name].least is not None]
    return set(standing), {n: d for n in timed if (d := _doubts(choice, full, n, told))}


def _doubts(choice: Choice, full: Examination, name: str, told: float) -> list[str]:
    """Other effects beside which one of timing would be too small to mention."""
    column = choice.fitter.model.index[standing_kinds()[name].in_every_model[0]]
    start, least = reduced(name, full.point, told)
    return doubtful(choice, lambda fit: start + float(fit.theta[column]), least)


def _families(choice: Choice) -> list[Effect]:
    """Columns of what was chosen; those of a gain about its size."""
    theta = choice.fitter.fit(choice.free, held_out=False).theta
    sized = [(c.columns, theta[list(c.index)]) for c in choice.chosen if c.columns is not None]
    return _about_sizes(sized)


def _about_sizes(sized: Sequence[tuple[Effect, Array]]) -> list[Effect]:
    """Effects of which those in proportion to the force act on the force without the others."""
    alone = [(f.about(size, ()), size) for f, size in sized]
    return [
        f.about(size, [a for j, a in enumerate(alone) if j != i and a[0].changes_force])
        for i, (f, size) in enumerate(alone)
    ]


def _final(full: Examination, choice: Choice, families: Sequence[Effect]) -> Examination:
    """The model that was chosen, about what the sums of everything say of it."""
    model = choice.fitter.model
    fit = choice.fitter.fit(choice.free, held_out=False)
    final = Examination(
        full,
        families,
        t0=full.point.skew_from,
        start=full,
        point=moved(full.point, model, fit.theta),
    )
    theta, covariance = final.model.prior.copy(), np.diag(final.model.prior_sigma**2)
    mine = [i for i, u in enumerate(final.model.unknowns) if u.name in model.index]
    theirs = [model.index[final.model.unknowns[i].name] for i in mine]
    theta[mine] = fit.theta[theirs]
    covariance[np.ix_(mine, mine)] = fit.covariance[np.ix_(theirs, theirs)]
    return final.with_rows(theta, covariance)


def _again(full: Examination, families: Sequence[Effect], final: Examination) -> Examination:
    """Another model than the final one, from where that one has come to."""
    return Examination(full, families, t0=full.point.skew_from, start=final)


def _needed(made: Examination, families: Sequence[Effect]) -> list[Effect]:
    """Families that stay significant when all of them are in one model."""
    fitter = Fitter(made.all_blocks, made.model, made.found().variance_inflation, made.absent)
    kept = list(families)
    base = [i for i in range(made.model.size) if i not in set(made.indices_of(families))]
    while kept:
        free = base + made.indices_of(kept)
        # What a needless jump makes of the offsets must not weaken what is said for the others.
        fitter.variance_inflation = fitter.variance_inflation_of(free)
        with_all = fitter.fit(free, held_out=False)
        worst, least = None, np.inf
        for family in kept:
            c = candidate_of(made, family)
            rest = [i for i in free if i not in c.index]
            bic = c.bic(fitter, fitter.fit(rest, held_out=False), with_all)
            if bic < least and not (bic > FAIR and reconciles(fitter, rest, c.index)):
                worst, least = family, bic
        if least >= MARGIN:
            break
        kept = [f for f in kept if f is not worst]
    return kept
