"""Timing and constant attitude errors against what else could explain what is taken for them."""

from __future__ import annotations

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import Choice, confounders_of, reconsider_nuisance
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.nuisance_effects import (
    Measured,
    nuisance_effects,
    nuisance_kinds,
    without,
)
from onboard.core.estimate.calibration_record import timing_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.estimate.solution import Solution
from onboard.core.maths.arrays import Array
from onboard.core.physics.effect import NuisanceFit


def compared(
    choice: Choice, full: Examination, calibrator: Calibrator, imu: int
) -> dict[str, list[str]]:
    """What does better in the place of a large effect that is in every model is taken.

    Returns:
        Of the timing that is large all the same, others that do about as well.
    """
    told = fix_clock(calibrator.parameters, full.batches).configured_on_stamp
    large: Measured = {}
    for _ in nuisance_kinds():
        large = _large(choice, full, calibrator, imu)
        targets = (_target(choice, full, name, told) for name in large)
        if not any(reconsider_nuisance(choice, target, held) for target, held in targets):
            break
    return {
        name: others
        for name in large
        if nuisance_kinds()[name].least is not None
        if (others := _rivals(choice, *_target(choice, full, name, told)))
    }


def _large(choice: Choice, full: Examination, calibrator: Calibrator, imu: int) -> Measured:
    """Effects that are in every model, as large as they are in the model that was chosen."""
    fitter = choice.fitter
    fit = fitter.fit(choice.free, held_out=False)
    covariance = fitter.covariance(fit)
    solution = Solution(
        fit.theta, covariance, fitter.sums.N, 1.0, contradicts=False, nis=1.0, rows=1.0
    )
    nuisances = NuisanceFit(
        timing=timing_of(full, solution),
        theta=fit.theta,
        sigma=np.sqrt(np.diag(covariance)),
        index=fitter.model.index,
        point=full.point,
        parameters=calibrator.parameters,
        imu=imu,
        clock=fix_clock(calibrator.parameters, full.batches),
    )
    return nuisance_effects(lambda _: nuisances)


def _target(choice: Choice, full: Examination, name: str, told: float) -> tuple[Candidate, Array]:
    """An effect that is in every model as one on trial, and unknowns (m,) without it."""
    unknowns, index = nuisance_kinds()[name].in_every_model, choice.fitter.model.index
    held = without(unknowns, index, full.point, choice.fitter.absent, told)
    return Candidate(name, tuple(index[c] for c in unknowns), ()), held


def _rivals(choice: Choice, target: Candidate, held: Array) -> list[str]:
    """Other effects that do about as well in the place of one of timing."""
    rest = [i for i in choice.free if i not in target.index]
    others = [c for c in choice.candidates if c not in choice.chosen]
    found = confounders_of(choice.fitter, rest, target, others, held)
    return [r.name for r in found if r.delta_bic < CLEARLY]
