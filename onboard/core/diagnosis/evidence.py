"""The evidence put together: effects with their sizes, the ladder of models, the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.candidates import smallest
from onboard.core.diagnosis.companions import Companions
from onboard.core.diagnosis.epochs import rms
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.excess import excess_in_words, spoils
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.findings import Findings
from onboard.core.diagnosis.flight_constants import inconstant
from onboard.core.diagnosis.hypotheses import Choice, of_others
from onboard.core.diagnosis.limits import CLEARLY, FALSE_ALARM, NOISE
from onboard.core.diagnosis.nuisance_effects import (
    constant_unknowns,
    nuisance_kinds,
    timing_unknowns,
)
from onboard.core.diagnosis.plain import plain_six
from onboard.core.diagnosis.records import (
    Ambiguity,
    Diagnosis,
    Inconstant,
    Mismatch,
    NotTestable,
    Rung,
    Unseen,
    Unused,
    Verdict,
)
from onboard.core.diagnosis.refusals import LONG_S, Refused
from onboard.core.diagnosis.regimes import regime_residuals
from onboard.core.diagnosis.score import surprise
from onboard.core.diagnosis.selection import Fit
from onboard.core.diagnosis.undecided import in_words, left_open, undecided
from onboard.core.estimate.calibration_status import too_far
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Calibration
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import LeverArmError
from onboard.core.physics.catalogue import kind_of, kinds
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.mount_tilt import trim_in_words
from onboard.core.physics.finding import Finding

CUT = "the accelerometer clipped nearly all the time, so that nothing is known of its numbers"


@dataclass(frozen=True, slots=True)
class Evidence:
    """The models: everything, what was chosen of it, the one that is reported, what is in doubt.

    ``about`` is what was chosen by sums about the jumps of the reported model.

    ``companions`` are all accelerometers of the vehicle; ``believed`` is the number of fixes of the
    flight that were to be used, ``unused`` flight without any; ``sampled`` is the flight as it was
    sampled, but for what is false; ``clipped`` if the accelerometer was at its rail so much of it
    that nothing was left out; ``heard`` is what is believed of it although the autopilot's filter
    gave the receiver up, ``at_odds`` where that fits no model.
    """

    full: Examination
    choice: Choice
    about: Choice
    final: Examination
    families: tuple[Effect, ...]
    doubts: Mapping[str, Sequence[str]]
    companions: Companions
    believed: int = 0
    unused: tuple[Unused, ...] = ()
    sampled: tuple[Batch, ...] = ()
    clipped: bool = False
    heard: tuple[Refused, ...] = ()
    at_odds: tuple[Unused, ...] = ()
    blows: tuple[tuple[float, float], ...] = ()


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
        self.calibrator, self.imu, self.evidence = calibrator, imu, evidence
        self.engine, self.choice, self.sampled = evidence.final, evidence.choice, evidence.sampled
        self.absent, self.excluded = list(absent), list(excluded)
        self.undecided = undecided(evidence.about, evidence.families)
        self.left_open = left_open(self.undecided) + _unsteady(evidence)
        made = calibrator.calibration_with(imu, evidence.final, self.left_open)
        self.calibration: Calibration = made.untold(CUT) if evidence.clipped else made
        self.final = FinalModel(evidence.final, evidence.families, origin, calibrator.parameters)
        self.findings = Findings(self.final, evidence.choice, evidence.full.point)

    def diagnosis(self) -> Diagnosis:
        """Everything that is said about the recording."""
        nuisances = self.final.nuisances(self.imu)
        families = self.final.families
        ladder, fits = self.final.ladder()
        before, after = fits[0], fits[-1]
        effects = self.findings.made(self.imu, self.evidence.doubts) + self.excluded
        every = (*self._at_odds(), *inconstant(self.final))
        # What contradicts the model bends what else there is to doubt.
        changing = tuple(c for c in every if c.contradicts) or every
        # What was clipped is left out of the fit, and was flown all the same.
        moving = self.engine.moving or self.calibrator.engine(self.imu).moving
        mismatch = self._mismatch(before, after, effects, ladder)
        verdict, note = self._verdict(effects, mismatch, changing, moving=moving)
        trim = trim_in_words(self.calibrator.parameters)
        c = self.calibration
        claimed = np.array(c.covariance).diagonal()
        others = of_others(self.choice, self.final.origin.t0, claimed)
        open_ = in_words(self.undecided, SixParameters(c.scale, c.offset), claimed)
        right = _right_all_the_same(self.evidence.heard, self.final.origin.t0)
        struck = _struck(self.evidence.blows)
        note = " ".join(x for x in (note, struck, right, open_, others, trim) if x)
        if verdict is Verdict.INSUFFICIENT:
            effects = []
        effects.sort(key=lambda e: -e.share_of_mismatch)
        unseen = self._unseen(effects)
        return Diagnosis(
            imu=self.imu,
            verdict=verdict,
            calibration=self.calibration,
            timing=dict(nuisances.timing),
            mismatch=mismatch,
            effects=tuple(effects),
            ambiguous=self._ambiguous(effects),
            not_testable=(*self.absent, *self._too_weak(unseen)),
            unseen=unseen,
            inconstant=() if verdict is Verdict.INSUFFICIENT else changing,
            ladder=ladder,
            regimes=regime_residuals(
                self.final.epochs,
                self.engine.all_blocks,
                self.engine.batches,
                before.theta,
                after.theta,
            ),
            series=self.final.series(before.theta, after.theta),
            note=note,
            plain=plain_six(self.engine, families) if families else None,
            unused=self.evidence.unused
            if verdict is not Verdict.INSUFFICIENT
            else _not_compared(self.evidence.unused),
        )

    def _mismatch(
        self, before: Fit, after: Fit, effects: Sequence[Finding], ladder: Sequence[Rung]
    ) -> Mismatch:
        fitter = self.final.fitter
        names = [*timing_unknowns(), *constant_unknowns()]
        added = [self.final.index[n] for n in names]
        added += self.engine.indices_of(self.final.families)
        gain = fitter.gain_by(added, before, after)
        series = self.final.series(before.theta, after.theta)
        score = surprise(gain.fall, len(added), variance=gain.variance, freedom=gain.freedom)
        p_value = float(np.exp(-0.5 * score))
        return Mismatch(
            detected=p_value < FALSE_ALARM,
            whitened_rms_before=fitter.rms(before),
            whitened_rms_after=fitter.rms(after),
            p_value=p_value,
            velocity_rms_before=rms(series.before),
            velocity_rms_after=rms(series.after),
            held_out_before=fitter.held_rms(before),
            held_out_after=fitter.held_rms(after),
            where=self.final.where(
                self.final.places_of({e.name for e in effects}), before.theta, after.theta
            ),
            held_out_velocity_before=ladder[0].held_out_velocity,
            held_out_velocity_after=ladder[-1].held_out_velocity,
            fixes=int(np.any(np.isfinite(series.after), axis=1).sum()),
            believed=self.evidence.believed,
            leaps=self.engine.refused["tilt"],
        )

    def _verdict(
        self,
        effects: list[Finding],
        mismatch: Mismatch,
        changing: Sequence[Inconstant],
        *,
        moving: bool,
    ) -> tuple[Verdict, str]:
        note = self.calibration.note
        # What a hover shows it shows; that it shows nothing does not mean that nothing is there.
        if not moving and not effects:
            return Verdict.INSUFFICIENT, "too little excitation to say. " + note
        if not mismatch.fit:
            return Verdict.INSUFFICIENT, (
                f"only {mismatch.fixes} of {mismatch.believed} GPS fixes fit one model of this "
                "flight; where more than half do not, nothing tells which are false. " + note
            )
        if mismatch.leaping:
            return Verdict.INSUFFICIENT, (
                f"the recorded attitude leaps against the gyroscope at {mismatch.leaps} of "
                f"{mismatch.fixes} fixes; where it does at more than half, nothing tells which of "
                "the two is false. " + note
            )
        note = " ".join([*(f"{c.words}; nothing of it is set." for c in changing), note])
        # A model that is said to explain a flight predicts what it has not seen of it.
        left = self.final.solution.contradicts or mismatch.held_out_after > NOISE
        named = [e for e in effects if (kind := kind_of(e.name)) is not None and kind.named]
        if len(named) < len(effects):
            return Verdict.PARTLY_EXPLAINED if named else Verdict.UNEXPLAINED, (
                "a formula of measured signals describes what no effect of the catalogue explains. "
                + note
            )
        if too_far(self.engine, self.final.solution):
            return Verdict.PARTLY_EXPLAINED if effects else Verdict.UNEXPLAINED, (
                "what was found may stand for something that is not in the model. " + note
            )
        misled = any(f.misleads_ekf for f in self.final.families)
        if excess := excess_in_words(self.engine.noise, misled=misled):
            note = f"{excess} {note}"
        if spoils(self.engine.noise):
            return Verdict.PARTLY_EXPLAINED if effects else Verdict.UNEXPLAINED, note
        if not left and any(c.contradicts for c in changing):
            return Verdict.PARTLY_EXPLAINED if effects else Verdict.UNEXPLAINED, note
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

    def _at_odds(self) -> tuple[Inconstant, ...]:
        """An accelerometer and a receiver that contradict each other until the flight ends.

        Where both agree again, what the accelerometer is was the same before and after.
        """
        far = self.evidence.at_odds
        if not far:
            return ()
        end, t0 = far[-1].end_s, self.final.origin.t0
        used = [float(b.fixes.t[b.trusted][-1]) for b in self.engine.batches if b.trusted.any()]
        if max(used, default=t0) - t0 > end + LONG_S:
            return ()
        words = (
            f"from {far[0].start_s:.0f} s on GPS is far from this accelerometer and its attitude, "
            "and nothing tells which is false"
        )
        return (Inconstant(BiasStep.effect, words),)

    def _ambiguous(self, effects: list[Finding]) -> tuple[Ambiguity, ...]:
        by_name = {f.effect: f for f in self.final.families}
        out = []
        for e in effects:
            close = [r.name for r in e.confounders if r.delta_bic < CLEARLY and r.name != e.name]
            if close and e.name in by_name:
                out.append(Ambiguity((e.name, *close), by_name[e.name].apart))
            kind = nuisance_kinds().get(e.name)
            if kind is not None and not self.final.that_tells(kind).holds(e.name):
                # It holds only with the antenna where it was told to be.
                out += [
                    Ambiguity((e.name, k.effect), k.apart)
                    for k in kinds()
                    if k.instead_of == LeverArmError.name
                ]
        out += [
            Ambiguity((name, *others), nuisance_kinds()[name].apart)
            for name, others in self.evidence.doubts.items()
        ]
        return tuple(out)

    def _unseen(self, effects: Sequence[Finding]) -> tuple[Unseen, ...]:
        """Effects that were looked for and not found, and the sizes that would have been."""
        named = {e.name for e in effects}
        choice = self.choice
        out: list[Unseen] = []
        for c in choice.candidates:
            if c.columns is None or c.effect in named or any(n.name == c.effect for n in out):
                continue
            rest = [i for i in choice.free if i not in c.index]
            fit = choice.fitter.fit([*rest, *c.index], held_out=False)
            sizes = smallest(choice.fitter, fit, c)
            keys = dict(zip(c.columns.keys, sizes.tolist(), strict=False))
            out.append(Unseen(c.effect, keys, c.columns.unknowns[0].unit))
        if choice.jump_from is not None and BiasStep.effect not in named:
            keys = dict(zip("xyz", choice.jump_from.tolist(), strict=True))
            out = [n for n in out if n.name != BiasStep.effect]
            out.append(Unseen(BiasStep.effect, keys, "m/s^2"))
        return tuple(out)

    def _too_weak(self, unseen: Sequence[Unseen]) -> list[NotTestable]:
        """Effects that this flight could not have shown at any plausible size."""
        offered = reversed(self.choice.candidates)  # simpler forms of an effect come first
        plausible = {c.effect: c for c in offered if c.columns is not None}
        return [
            NotTestable(
                u.name,
                "this flight would not show it at any plausible size: " + c.columns.apart,
            )
            for u in unseen
            if (c := plausible.get(u.name)) is not None
            and c.columns is not None
            and all(s > p for s, p in zip(u.smallest.values(), c.plausible, strict=True))
        ]


def _unsteady(evidence: Evidence) -> Array:
    """(6, 6) by how much scale and beta of another flight differ, by what was found."""
    R_bs = evidence.final.batches[0].segment.R_bs
    by_axis = sum((f.unsteady() for f in evidence.families), np.zeros(3))
    out = np.zeros((6, 6))
    out[3:, 3:] = np.diag(R_bs.T**2 @ by_axis)
    return out


def _right_all_the_same(heard: Sequence[Refused], t0: float) -> str:
    """That a receiver is believed although the autopilot's filter complained of it."""
    if not heard:
        return ""
    when = ", ".join(f"{r.start - t0:.0f} to {r.end - t0:.0f} s" for r in heard)
    return f"fixes that the autopilot's filter complained of ({when}) fit, and are used."


def _struck(blows: Sequence[tuple[float, float]]) -> str:
    """That the vehicle was struck, and what became of it."""
    if not blows:
        return ""
    when = ", ".join(f"{0.5 * (a + b):.0f} s" for a, b in blows)
    return (
        f"the velocity jumps where vibration does (at {when}), as it does when a vehicle is struck "
        "and its samples miss how hard, and that is left out."
    )


def _not_compared(unused: Sequence[Unused]) -> tuple[Unused, ...]:
    """Of a flight that says nothing, an inertia that says nothing of the fixes either."""
    return tuple(replace(u, contradicted=None) for u in unused)
