"""The evidence put together: effects with their sizes, the ladder of models, the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.epochs import Epochs, rms
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.hypotheses import (
    HELD_OUT_GAIN,
    MARGIN,
    SIGNIFICANT,
    Candidate,
    Choice,
    confounders_of,
)
from onboard.core.diagnosis.plain import plain_six
from onboard.core.diagnosis.records import (
    Ambiguity,
    Diagnosis,
    Mismatch,
    NotTestable,
    Rung,
    Series,
    Unused,
    Verdict,
)
from onboard.core.diagnosis.regimes import (
    Residuals,
    axis_of,
    located,
    main_axis,
    regime_residuals,
    spans,
)
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.diagnosis.standing import (
    constant_unknowns,
    standing_effects,
    standing_kinds,
    timing_unknowns,
    without,
)
from onboard.core.estimate.calibration_record import timing_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.estimate.limits import CONTRADICTION
from onboard.core.estimate.result import Calibration
from onboard.core.maths.arrays import Array
from onboard.core.maths.chi_square import survival
from onboard.core.model.nuisances import LeverArmError
from onboard.core.physics.catalogue import kind_of, kinds, response_of
from onboard.core.physics.effect import Cure, Effect, Origin, Standing
from onboard.core.physics.effects.mount_tilt import trim_in_words
from onboard.core.physics.finding import Confounder, Finding, Quantity, Where

ONSET_S = 0.5
"""Sigma of a moment that is searched at half seconds, s."""
AMBIGUOUS = 10.0
"""Confounders within this difference of BIC cannot be told apart."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """The models: everything, what was chosen of it, the one that is reported, what is in doubt.

    ``believed`` is the number of fixes of the flight that were to be used, ``unused`` flight
    without any.
    """

    full: Examination
    choice: Choice
    final: Examination
    families: tuple[Effect, ...]
    doubts: Mapping[str, Sequence[str]]
    believed: int = 0
    unused: tuple[Unused, ...] = ()


class Judge:
    """Puts the evidence together."""

    def __init__(
        self,
        calibrator: Calibrator,
        imu: int,
        evidence: Evidence,
        origin: Origin,
        absent: Sequence[NotTestable],
        excluded: Sequence[Finding],
    ) -> None:
        """Take the flight, the models, what cannot be asked, and what was left out of the fit."""
        final = evidence.final
        self.calibrator, self.imu, self.engine = calibrator, imu, final
        self.families, self.origin = list(evidence.families), origin
        self.choice, self.absent = evidence.choice, list(absent)
        self.full_point, self.doubts = evidence.full.point, evidence.doubts
        self.believed, self.unused = evidence.believed, evidence.unused
        self.excluded = list(excluded)
        self.clock = fix_clock(calibrator.parameters, final.batches)
        self.traces = final.traces
        self.epochs = Epochs.of(final.traces, final.all_blocks, final.model.size)
        self.calibration: Calibration = calibrator.calibration_with(imu, final)
        self.solution = final.found()
        self.fitter = Fitter(
            final.all_blocks, final.model, self.solution.variance_inflation, final.absent
        )
        self.index = final.model.index
        self.all = list(range(final.model.size))
        self.axes = self._axes()

    def _axes(self) -> dict[int, str]:
        """Body axis of each column that acts on one."""
        keys = {i: name.rsplit("_", 1)[-1] for name, i in self.index.items() if i < 6}
        keys |= {self.index["tilt_roll"]: "roll", self.index["tilt_pitch"]: "pitch"}
        for f in self.families:
            keys |= dict(zip(self.engine.indices(f), f.keys, strict=True))
        return {i: axis for i, key in keys.items() if (axis := axis_of(key)) is not None}

    def diagnosis(self) -> Diagnosis:
        """Everything that is said about the recording."""
        timing = timing_of(self.engine, self.solution)
        standing = standing_effects(
            Standing(
                timing=timing,
                theta=self.solution.theta,
                sigma=np.sqrt(np.diag(self.solution.covariance)),
                index=self.index,
                point=self.engine.point,
                parameters=self.calibrator.parameters,
                imu=self.imu,
                clock=self.clock,
            )
        )
        # A name has one effect: what stands beside columns of its own is their consequence.
        named = {f.effect for f in self.families}
        ladder, fits = self._ladder()
        before, after = fits[0], fits[-1]
        effects = [
            self._standing(n, q, cure)
            for n, (q, cure) in standing.items()
            if n not in self.doubts and n not in named and self._holds(n)
        ]
        effects += [self._effect(f) for f in self.families]
        effects += self.excluded
        # What was clipped is left out of the fit, and was flown all the same.
        insufficient = not (self.engine.moving or self.calibrator.engine(self.imu).moving)
        mismatch = self._mismatch(before, after, effects, ladder)
        verdict, note = self._verdict(effects, mismatch, insufficient=insufficient)
        note = " ".join(x for x in (note, trim_in_words(self.calibrator.parameters)) if x)
        if verdict is Verdict.INSUFFICIENT:
            effects = []
        effects.sort(key=lambda e: -e.share_of_mismatch)
        return Diagnosis(
            imu=self.imu,
            verdict=verdict,
            calibration=self.calibration,
            timing=timing,
            mismatch=mismatch,
            effects=tuple(effects),
            ambiguous=self._ambiguous(effects),
            not_testable=(*self.absent, *self._too_weak(effects)),
            ladder=ladder,
            regimes=regime_residuals(self.traces, self.engine.batches, before.theta, after.theta),
            series=self._series(before.theta, after.theta),
            note=note,
            plain=plain_six(self.engine, self.families) if self.families else None,
            unused=self.unused
            if verdict is not Verdict.INSUFFICIENT
            else _not_compared(self.unused),
        )

    def _held(self, names: Sequence[str]) -> Array:
        """Unknowns of ``names`` at the value that means *not in the model*."""
        told = self.clock.configured_on_stamp
        return without(names, self.index, self.engine.point, self.engine.absent, told)

    def _ladder(self) -> tuple[tuple[Rung, ...], list[Fit]]:
        """Six numbers only, + timing, + constant attitude errors, + each effect."""
        timing, constant = timing_unknowns(), constant_unknowns()
        late, turned = ([self.index[n] for n in names] for names in (timing, constant))
        mine = self.engine.indices_of(self.families)
        free = [i for i in self.all if i not in (*late, *turned, *mine)]
        rungs: list[Rung] = []
        fits: list[Fit] = []

        def climb(name: str, held: Array | None = None) -> None:
            fit = self.fitter.fit(free, held)
            fits.append(fit)
            rungs.append(
                Rung(
                    name,
                    self.fitter.rms(fit),
                    self.fitter.held_rms(fit),
                    rms(self.epochs.residual(fit.theta)),
                    self._held_velocity(free, held),
                )
            )

        climb("six numbers only", self._held([*timing, "heading"]))
        free = free + late
        climb("+ timing", self._held(["heading"]))
        free = free + turned
        climb("+ attitude")
        for f in self.families:
            free = free + self.engine.indices(f)
            climb(f"+ {f.effect}")
        return tuple(rungs), fits

    def _without(self, index: Sequence[int], held: Array | None = None) -> tuple[Fit, Fit]:
        rest = [i for i in self.all if i not in index]
        return self.fitter.fit(rest, held), self.fitter.fit(self.all)

    def _evidence(self, name: str, among: Sequence[int]) -> tuple[float, float]:
        """Fall of BIC, and of held-out chi-square, by timing or a constant attitude error."""
        columns = standing_kinds()[name].in_every_model
        target = Candidate(name, tuple(self.index[c] for c in columns), ())
        rest = [i for i in among if i not in target.index]
        absent, with_it = self.fitter.fit(rest, self._held(columns)), self.fitter.fit(among)
        return target.bic(self.fitter, absent, with_it), self.fitter.held_gain(absent, with_it)

    def _share(self, without: Fit, with_it: Fit) -> float:
        left = max(without.chi2, 1e-12)
        return float(np.clip((without.chi2 - with_it.chi2) / left, 0.0, 1.0))

    def _standing(self, name: str, quantities: dict[str, Quantity], cure: Cure) -> Finding:
        columns = standing_kinds()[name].in_every_model
        index = [self.index[c] for c in columns]
        held = self._held(columns)
        made = self._record(name, quantities, index, held, cure)
        return replace(made, confounders=self._standing_confounders(name, columns))

    def _holds(self, name: str) -> bool:
        """Whether timing or a constant attitude error is needed, also on data not fitted.

        With the antenna's place free, or with the antenna where it was told to be: a few
        centimetres of it could do instead on some flights, which is said besides.
        """
        every = (self._evidence(name, among) for among in (self.all, self._told_antenna()))
        return any(bic >= MARGIN and held >= HELD_OUT_GAIN for bic, held in every)

    def _told_antenna(self) -> list[int]:
        place = self.engine.model.slices.get(LeverArmError.name, slice(0, 0))
        return [i for i in self.all if not place.start <= i < place.stop]

    def _standing_confounders(self, name: str, columns: Sequence[str]) -> tuple[Confounder, ...]:
        """What else could stand for timing or a constant attitude error, by the full sums."""
        choice, full = self.choice, self.choice.fitter.model.index
        target = Candidate(name, tuple(full[c] for c in columns), ())
        rest = [i for i in choice.free if i not in target.index]
        told = self.clock.configured_on_stamp
        held = without(columns, full, self.full_point, choice.fitter.absent, told)
        others = [c for c in choice.candidates if c not in choice.chosen and c.effect != name]
        return tuple(confounders_of(choice.fitter, rest, target, others, held))

    def _effect(self, f: Effect) -> Finding:
        index = [i for i in self.all if i in self.engine.indices(f)]
        sigma = np.sqrt(np.diag(self.solution.covariance))
        taken = {"clock_rate": self.engine.point.skew}
        quantities = {
            key: Quantity(
                float(self.solution.theta[i]) + taken.get(u.name, 0.0), float(sigma[i]), u.unit
            )
            for key, i, u in zip(f.keys, index, f.unknowns, strict=True)
        }
        if f.onset is not None:
            quantities = {"time": Quantity(f.onset - self.origin.t0, ONSET_S, "s"), **quantities}
        values = {k: q.value for k, q in quantities.items()}
        held = self.engine.absent
        made = self._record(f.effect, quantities, index, held, f.cured(values))
        made = replace(
            made,
            confounders=self._confounders(f),
            formula=f.formula([quantities[k].value for k in f.keys]),
        )
        if f.onset is None:
            return made
        span = ((f.onset - self.origin.t0, self.engine.blocks[-1].end - self.origin.t0),)
        axis = main_axis(self.solution.theta[index])
        return replace(made, where=spans(self.engine.batches, self.origin.t0, span, axis))

    def _record(
        self,
        name: str,
        quantities: dict[str, Quantity],
        index: Sequence[int],
        held: Array,
        cure: Cure,
    ) -> Finding:
        without, with_it = self._without(index, held)
        rest = [i for i in self.all if i not in index]
        theta = self.solution.theta
        bic = self.fitter.gain(without, with_it) - len(index) * np.log(max(self.fitter.rows, 2.0))
        return Finding(
            name=name,
            unknowns=quantities,
            share_of_mismatch=self._share(without, with_it),
            delta_bic=-float(bic),
            held_out_before=self.fitter.held_rms(without),
            held_out_after=self.fitter.held_rms(with_it),
            parameters=dict(cure.parameters),
            cure=cure.words,
            where=self._where(index, without.theta, with_it.theta),
            held_out_velocity_before=self._held_velocity(rest, held),
            held_out_velocity_after=self._held_velocity(self.all),
            imprint=self.epochs.imprint(
                index, theta[list(index)] - held[list(index)], theta, self.origin.t0
            ),
            response_curve=response_of(
                name, quantities, self.engine.batches, self.origin.t0, self.origin.temperature
            ),
        )

    def _where(self, index: Sequence[int], before: Array, after: Array) -> tuple[Where, ...]:
        """Where the residual falls when the columns ``index`` are added."""
        series = self._series(before, after)
        return located(
            self.fitter.blocks,
            self.engine.batches,
            before,
            after,
            self.origin.t0,
            {i: self.axes[i] for i in index if i in self.axes},
            Residuals(series.t + self.origin.t0, series.before, series.after),
        )

    def _found(self, effects: Sequence[Finding]) -> list[int]:
        """Columns of what was found; where nothing was, of the six."""
        names = {e.name for e in effects}
        standing = standing_kinds().items()
        out = [self.index[u] for n, k in standing if n in names for u in k.in_every_model]
        out += self.engine.indices_of([f for f in self.families if f.effect in names])
        return out or list(range(6))

    def _mismatch(
        self, before: Fit, after: Fit, effects: Sequence[Finding], ladder: Sequence[Rung]
    ) -> Mismatch:
        gain = self.fitter.gain(before, after)
        added = (
            len(timing_unknowns())
            + len(constant_unknowns())
            + len(self.engine.indices_of(self.families))
        )
        series = self._series(before.theta, after.theta)
        return Mismatch(
            detected=bool(gain > added * self.fitter.log_rows + MARGIN),
            whitened_rms_before=self.fitter.rms(before),
            whitened_rms_after=self.fitter.rms(after),
            p_value=survival(max(gain, 0.0), added),
            velocity_rms_before=rms(series.before),
            velocity_rms_after=rms(series.after),
            held_out_before=self.fitter.held_rms(before),
            held_out_after=self.fitter.held_rms(after),
            where=self._where(self._found(effects), before.theta, after.theta),
            held_out_velocity_before=ladder[0].held_out_velocity,
            held_out_velocity_after=ladder[-1].held_out_velocity,
            fixes=int(np.any(np.isfinite(series.after), axis=1).sum()),
            believed=self.believed,
        )

    def _series(self, before: Array, after: Array) -> Series:
        e = self.epochs
        return Series(e.t - self.origin.t0, e.residual(before), e.residual(after), e.refused)

    def _held_velocity(self, free: Sequence[int], held: Array | None = None) -> float:
        """Velocity residual, m/s, on blocks that a fit of ``free`` has not seen."""
        return self.epochs.held_out_rms(self.fitter.held_fits(free, held))

    def _verdict(
        self, effects: list[Finding], mismatch: Mismatch, *, insufficient: bool
    ) -> tuple[Verdict, str]:
        note = self.calibration.note
        if insufficient:
            return Verdict.INSUFFICIENT, "too little excitation to say. " + note
        if not mismatch.supported:
            return Verdict.INSUFFICIENT, (
                f"only {mismatch.fixes} of {mismatch.believed} GPS fixes fit one model of this "
                "flight, and of more than half that do not nothing tells which are false. " + note
            )
        left = self.solution.variance_inflation > CONTRADICTION
        named = [e for e in effects if (kind := kind_of(e.name)) is not None and kind.named]
        if len(named) < len(effects):
            return Verdict.PARTLY_EXPLAINED if named else Verdict.UNEXPLAINED, (
                "a formula of measured signals describes what no effect of the catalogue explains. "
                + note
            )
        if effects:
            if left:
                return Verdict.PARTLY_EXPLAINED, (
                    "what was found does not explain all of the residual. " + note
                )
            return Verdict.EXPLAINED, note
        if left:
            return Verdict.UNEXPLAINED, (
                "the residual is not noise, and no effect of the catalogue explains it. " + note
            )
        return Verdict.CLEAN, note

    def _ambiguous(self, effects: list[Finding]) -> tuple[Ambiguity, ...]:
        by_name = {f.effect: f for f in self.families}
        out = []
        for e in effects:
            close = [r.name for r in e.confounders if r.delta_bic < AMBIGUOUS and r.name != e.name]
            if close and e.name in by_name:
                out.append(Ambiguity((e.name, *close), by_name[e.name].apart))
            if e.name in standing_kinds() and self._evidence(e.name, self.all)[0] < MARGIN:
                # It holds only with the antenna where it was told to be.
                out += [
                    Ambiguity((e.name, k.effect), k.apart)
                    for k in kinds()
                    if k.instead_of == LeverArmError.name
                ]
        out += [
            Ambiguity((name, *others), standing_kinds()[name].apart)
            for name, others in self.doubts.items()
        ]
        return tuple(out)

    def _confounders(self, f: Effect) -> tuple[Confounder, ...]:
        for c in self.choice.chosen:
            if c.effect == f.effect:
                return tuple(self.choice.confounders(c))
        return ()

    def _too_weak(self, effects: list[Finding]) -> list[NotTestable]:
        """Effects that this flight could not have shown at any plausible size."""
        named = {e.name for e in effects}
        out: list[NotTestable] = []
        for c in self.choice.candidates:
            if c.columns is None or c.effect in named or any(n.name == c.effect for n in out):
                continue
            index = list(c.index)
            rest = [i for i in self.choice.free if i not in index]
            fit = self.choice.fitter.fit([*rest, *index], held_out=False)
            sigma = np.sqrt(np.diag(fit.covariance)[index])
            if np.all(sigma * SIGNIFICANT > np.array(c.plausible)):
                out.append(
                    NotTestable(
                        c.effect,
                        "this flight would not show it at any plausible size: " + c.columns.apart,
                    )
                )
        return out


def _not_compared(unused: Sequence[Unused]) -> tuple[Unused, ...]:
    """Of a flight that says nothing, an inertia that says nothing of the fixes either."""
    return tuple(replace(u, contradicted=None) for u in unused)
