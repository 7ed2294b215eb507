"""Findings: every effect that was found, with its size, its evidence and its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.hypotheses import Choice, confounders_of
from onboard.core.diagnosis.nuisance_effects import nuisance_effects, nuisance_kinds, without
from onboard.core.diagnosis.regimes import main_axis, spans
from onboard.core.estimate.calibration_model import reversed_of
from onboard.core.maths.arrays import Array
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.catalogue import response_of
from onboard.core.physics.effect import Cure, Effect
from onboard.core.physics.effects.bias_step import SHARED_CURE, SWITCHED_CURE, BiasStep
from onboard.core.physics.finding import Confounder, Finding, Quantity


class Findings:
    """Makes the findings of a final model."""

    def __init__(self, final: FinalModel, choice: Choice, full_point: Linearisation) -> None:
        """Take the final model, the choice that led to it, and what the choice is counted from."""
        self._final, self._choice, self._full_point = final, choice, full_point

    def made(self, imu: int, doubts: Mapping[str, Sequence[str]]) -> list[Finding]:
        """Everything that was found in the sums.

        Args:
            imu: which accelerometer.
            doubts: effects of them that something else could stand for.
        """
        # A name has one effect: what stands beside regressors of its own is their consequence.
        named = {f.effect for f in self._final.families}
        out = [
            self._nuisance(name, quantities, cure)
            for name, (quantities, cure) in nuisance_effects(
                lambda kind: self._final.that_tells(kind).nuisances(imu)
            ).items()
            if name not in doubts and name not in named and self._holds(name)
        ]
        return out + [self._effect(f) for f in self._final.families if not self._another(f)]

    def _another(self, f: Effect) -> bool:
        """Whether it has the sign that nature does not allow it, or no size: then it is another."""
        made, solution = self._final.engine.model, self._final.solution
        index = self._final.engine.indices(f)[: len(f.keys)]
        sigma = np.sqrt(np.diag(solution.covariance))[index]
        reverse = reversed_of(made, (f,), solution.theta, solution.covariance)
        return bool(reverse) or not f.there(solution.theta[index], sigma)

    def _nuisance(self, name: str, quantities: dict[str, Quantity], cure: Cure) -> Finding:
        kind = nuisance_kinds()[name]
        final, columns = self._final.that_tells(kind), kind.in_every_model
        index = [final.index[c] for c in columns]
        held = final.held(columns)
        made = self._record(final, name, quantities, index, held, cure)
        return replace(made, confounders=self._nuisance_confounders(name, columns))

    def _holds(self, name: str) -> bool:
        """Whether timing or a constant attitude error is no chance, and holds on data not fitted.

        With the antenna's place free, or with the antenna where it was told to be: a few
        centimetres of it could do instead on some flights, which is said besides.
        """
        final = self._final.that_tells(nuisance_kinds()[name])
        among = (final.all, final.with_configured_antenna())
        return any(final.holds(name, columns) for columns in among)

    def _nuisance_confounders(self, name: str, columns: Sequence[str]) -> tuple[Confounder, ...]:
        """What else could stand for timing or a constant attitude error, by the full sums."""
        final = self._final
        choice, full = self._choice, self._choice.fitter.model.index
        target = Candidate(name, tuple(full[c] for c in columns), ())
        rest = [i for i in choice.free if i not in target.index]
        told = final.clock.configured_on_stamp
        held = without(columns, full, self._full_point, choice.fitter.absent, told)
        others = [c for c in choice.candidates if c not in choice.chosen and c.effect != name]
        return tuple(confounders_of(choice.fitter, rest, target, others, held))

    def _effect(self, f: Effect) -> Finding:
        final = self._final
        index = [i for i in final.all if i in final.engine.indices(f)]
        held = final.engine.absent
        theta = (final.solution.theta - held)[index]
        C = final.solution.covariance[np.ix_(index, index)]
        quantities = f.sized(theta, C)
        if f.onset is not None:
            quantities = {
                "time": Quantity(f.onset - final.origin.t0, f.onset_sigma, "s"),
                **quantities,
            }
        values = {k: q.value for k, q in quantities.items()}
        cure = self._cure(f, values)
        made = self._record(final, f.effect, quantities, index, held, cure)
        made = replace(
            made,
            confounders=self._confounders(f),
            formula=f.formula([quantities[k].value for k in f.keys]),
        )
        if made.response_curve is not None and f.shaped:
            made = replace(made, response_curve=f.bent(made.response_curve, theta, C))
        if f.onset is None:
            return made
        span = ((f.onset - final.origin.t0, final.engine.blocks[-1].end - final.origin.t0),)
        axis = main_axis(theta)
        return replace(made, where=spans(final.engine.batches, final.origin.t0, span, axis))

    def _cure(self, f: Effect, values: Mapping[str, float]) -> Cure:
        """What to do about it, by its sizes, and by what happened to the vehicle just then."""
        parameters, common = self._final.parameters, self._choice.common
        if isinstance(f, BiasStep) and parameters.switched_at(
            self._final.origin.imu, f.moment, f.onset_sigma
        ):
            return SWITCHED_CURE
        shared = common is not None and f.onset == common.onset
        return SHARED_CURE if shared else f.cured(values)

    def _confounders(self, f: Effect) -> tuple[Confounder, ...]:
        for c in self._choice.chosen:
            if c.effect == f.effect:
                return tuple(self._choice.confounders(c))
        return ()

    def _record(
        self,
        final: FinalModel,
        name: str,
        quantities: dict[str, Quantity],
        index: Sequence[int],
        held: Array,
        cure: Cure,
    ) -> Finding:
        without, with_it = final.without(index, held)
        rest = [i for i in final.all if i not in index]
        theta = final.solution.theta
        gain = final.fitter.gain_by(index, without, with_it)
        bic = gain.weakened - len(index) * final.fitter.log_rows
        return Finding(
            name=name,
            unknowns=quantities,
            share_of_mismatch=final.share(without, with_it),
            delta_bic=-float(bic),
            held_out_before=final.fitter.held_rms(without),
            held_out_after=final.fitter.held_rms(with_it),
            parameters=dict(cure.parameters),
            cure=cure.words,
            where=final.where(index, without.theta, with_it.theta),
            held_out_velocity_before=final.held_velocity(rest, held),
            held_out_velocity_after=final.held_velocity(final.all),
            imprint=final.epochs.imprint(
                index, theta[list(index)] - held[list(index)], theta, final.origin.t0
            ),
            response_curve=response_of(
                name, quantities, final.engine.batches, final.origin.t0, final.origin.temperature
            ),
        )
