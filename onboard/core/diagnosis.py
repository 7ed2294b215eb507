"""Which physics the model left out of a recording: locate, decide, say.

The flight that a calibrator has kept goes once more through the filter with every column of the
catalogue; noise is estimated with all of them in, so that missing physics is not mistaken for
noise.  Selection is algebra on those sums; the final model is re-linearised and gives calibration,
timing and residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.calibrator import Calibrator
from onboard.core.engine import Chunk, Engine
from onboard.core.findings import (
    Ambiguity,
    Diagnosis,
    Effect,
    Mismatch,
    NotTestable,
    Quantity,
    Rival,
    Rung,
    Series,
    Verdict,
)
from onboard.core.passes import EpochTrace, Pass
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import EffectColumns, Origin
from onboard.core.physics.offsets import BiasStep
from onboard.core.regimes import located, regime_residuals
from onboard.core.report import timing_of
from onboard.core.result import Calibration
from onboard.core.selection import Fit, Fitter, step_times
from onboard.core.solution import Solution, solve
from onboard.core.timing_effects import fault_effect, saturation_effect, standing_effects

Array = NDArray[np.float64]

MARGIN = 25.0
"""Fall of chi-square beyond BIC's own penalty: a false discovery is worse than a miss."""
HELD_OUT_GAIN = 12.0
SIGNIFICANT = 5.0
MATTERS_SCALE, MATTERS_OFFSET, MATTERS_HELD_OUT = 0.005, 0.02, 0.03
MOST_EFFECTS = 5
AMBIGUOUS = 10.0
"""Rivals within this difference of BIC cannot be told apart."""
UNEXPLAINED = 6.0
"""Inflation of the variance past which the residual is not noise."""


@dataclass(slots=True)
class _Candidate:
    columns: EffectColumns
    index: list[int]


def diagnose(calibrator: Calibrator, imu: int) -> Diagnosis:
    """Diagnose one accelerometer's recording.

    Args:
        calibrator: finished; its settings' buffer must hold the flight of interest.
        imu: which accelerometer.

    Raises:
        KeyError: that accelerometer has not been seen.
    """
    engine = calibrator.engine(imu)
    chunks = engine.chunks
    antenna = calibrator.parameters.antenna
    origin = Origin(
        t0=calibrator.first_sample,
        antenna=(float(antenna[0]), float(antenna[1]), float(antenna[2])),
    )
    told = calibrator.parameters.gps_delay_told
    everything = catalogue(origin)
    testable, absent = _testable(everything, chunks)
    full = _engine(engine, chunks, testable, rounds=3, t0=origin.t0)
    solution = _solution(full)
    fitter = Fitter(full.all_portions, full.model, solution.inflation, _absent(full))
    base = [i for i, u in enumerate(full.model.unknowns) if not _is_effect(full, testable, i)]
    candidates = [
        _Candidate(c, list(range(*full.model.slices[c.name].indices(full.model.size))))
        for c in testable
    ]
    chosen, rivals = _select(fitter, base, candidates)
    step = _find_step(full, fitter, base, chosen, chunks)
    families = [c.columns for c in chosen] + ([step] if step else [])
    if step is not None:
        # A step may have passed for something slower: what it does not leave is dropped.
        families = _still_needed(engine, chunks, families, origin.t0)
    final = _engine(engine, chunks, families, rounds=2, t0=origin.t0, start=full)
    traces = _traces(final)
    calibration = calibrator.calibration_with(imu, final)
    return _Judge(
        calibrator,
        imu,
        final,
        families,
        rivals,
        traces,
        calibration,
        told,
        origin,
        absent,
        fitter,
        base,
        candidates,
    ).diagnosis()


def _engine(
    like: Engine,
    chunks: Sequence[Chunk],
    families: Sequence[EffectColumns],
    *,
    rounds: int,
    t0: float,
    start: Engine | None = None,
) -> Engine:
    """An engine over the same flight with more physics, refined."""
    origin = start or like
    settings = replace(like.settings, refine=True)
    point = replace(origin.point, skew_from=t0)
    if not any(f.effect == "clock_skew" for f in families):
        point = replace(point, skew=0.0)
    made = Engine(settings, like.prior, point, origin.noise, more=tuple(families))
    made.chunks = list(chunks)
    made.trusted_s = like.trusted_s
    made.refine(rounds, 2 if start is None else 0)
    return made


def _absent(engine: Engine) -> Array:
    """Values of the unknowns that mean that an effect is not in the model."""
    at = np.zeros(engine.model.size)
    if "clock_rate" in engine.model.index:
        at[engine.model.index["clock_rate"]] = -engine.point.skew
    return at


def _solution(engine: Engine) -> Solution:
    found = engine.solution()
    if found is None:
        raise KeyError("no flight was processed")
    return found


def _testable(
    everything: Sequence[EffectColumns], chunks: Sequence[Chunk]
) -> tuple[list[EffectColumns], list[NotTestable]]:
    present, absent = [], []
    names = set.intersection(*(set(c.stretch.slow) for c in chunks)) if chunks else set()
    for effect in everything:
        missing = [n for n in effect.needs if n not in names]
        if missing:
            absent.append(
                NotTestable(effect.effect, f"no {' and '.join(missing)} in the recording")
            )
            continue
        still = [n for n in effect.needs if _spread(chunks, n) < _LEAST_SPREAD.get(n, 0.0)]
        if still:
            absent.append(NotTestable(effect.effect, f"{' and '.join(still)} did not change"))
            continue
        present.append(effect)
    return present, absent


_LEAST_SPREAD = {"temperature": 0.5, "throttle": 0.03, "vibration": 0.05}


def _spread(chunks: Sequence[Chunk], name: str) -> float:
    values = [np.atleast_2d(c.stretch.slow[name][1].T) for c in chunks]
    joined = np.concatenate(values, axis=1)
    return float(np.max(np.percentile(joined, 98, axis=1) - np.percentile(joined, 2, axis=1)))


def _is_effect(engine: Engine, effects: Sequence[EffectColumns], i: int) -> bool:
    return any(
        engine.model.slices[e.name].start <= i < engine.model.slices[e.name].stop for e in effects
    )


def _select(
    fitter: Fitter, base: list[int], candidates: list[_Candidate]
) -> tuple[list[_Candidate], dict[str, list[Rival]]]:
    """Forward selection; also how much worse each rival would have done in each one's place."""
    chosen: list[_Candidate] = []
    rivals: dict[str, list[Rival]] = {}
    while len(chosen) < MOST_EFFECTS:
        free = base + [i for c in chosen for i in c.index]
        before = fitter.fit(free)
        scored = []
        for c in candidates:
            if c in chosen:
                continue
            after = fitter.fit(free + c.index)
            bic = fitter.gain(before, after) - len(c.index) * np.log(max(fitter.rows, 2.0))
            scored.append((bic, c, after))
        scored.sort(key=lambda s: -s[0])
        accepted = next(
            (s for s in scored if _accept(fitter, before, s[2], s[1], s[0])),
            None,
        )
        if accepted is None:
            break
        bic, best, after = accepted
        with_best = free + best.index
        here = []
        for other_bic, other, _ in scored:
            if other is best or other_bic <= 0:
                continue
            # A rival explains what the accepted one explains: little is left for it beside it.
            beside = fitter.gain(after, fitter.fit(with_best + other.index))
            alone = other_bic + len(other.index) * np.log(max(fitter.rows, 2.0))
            if beside < 0.5 * alone and other_bic > 0.3 * bic:
                here.append(Rival(other.columns.effect, float(bic - other_bic)))
        rivals[best.columns.name] = here
        chosen.append(best)
        chosen = _prune(fitter, base, chosen)
    return chosen, rivals


def _prune(fitter: Fitter, base: list[int], chosen: list[_Candidate]) -> list[_Candidate]:
    """Drop what became insignificant beside the newer ones."""
    kept = list(chosen)
    for c in chosen[:-1]:
        rest = [k for k in kept if k is not c]
        free = base + [i for k in rest for i in k.index]
        without, with_it = fitter.fit(free), fitter.fit(free + c.index)
        bic = fitter.gain(without, with_it) - len(c.index) * np.log(max(fitter.rows, 2.0))
        if bic < MARGIN:
            kept = rest
    return kept


def _accept(fitter: Fitter, before: Fit, after: Fit, c: _Candidate, bic: float) -> bool:
    if bic < MARGIN or fitter.held_gain(before, after) < HELD_OUT_GAIN:
        return False
    value = after.theta[c.index] - fitter.absent[c.index]
    sigma = np.sqrt(np.diag(after.covariance)[c.index])
    if np.max(np.abs(value) / sigma) < SIGNIFICANT:
        return False
    if np.any(np.abs(value) - 2.0 * sigma > np.array(c.columns.plausible)):
        return False
    return _matters(fitter, before, after)


def _matters(fitter: Fitter, before: Fit, after: Fit) -> bool:
    six0, six1 = before.theta[:6], after.theta[:6]
    moved_scale = float(np.max(np.abs(six1[:3] - six0[:3])))
    offset0, offset1 = -six0[3:] / six0[:3], -six1[3:] / six1[:3]
    moved_offset = float(np.max(np.abs(offset1 - offset0)))
    held0, held1 = fitter.held_rms(before), fitter.held_rms(after)
    return (
        moved_scale > MATTERS_SCALE
        or moved_offset > MATTERS_OFFSET
        or held1 < (1.0 - MATTERS_HELD_OUT) * held0
    )


def _find_step(
    full: Engine,
    fitter: Fitter,
    base: list[int],
    chosen: list[_Candidate],
    chunks: Sequence[Chunk],
) -> BiasStep | None:
    """A jump of the offsets: coarsely at portion boundaries, then to the second."""
    if len(fitter.portions) < 4:
        return None
    free = base + [i for c in chosen for i in c.index]
    coarse = max(step_times(fitter, free, [3, 4, 5]), key=lambda x: x[1])
    if coarse[1] < 3.0 * np.log(max(fitter.rows, 2.0)) + MARGIN:
        return None
    centre, width = coarse[0], 14.0
    best: tuple[float, BiasStep] | None = None
    for spacing in (2.0, 0.5):
        times = np.arange(centre - width, centre + width + 1e-6, spacing)
        steps = [BiasStep(float(t)) for t in times]
        scored = _score_steps(full, [c.columns for c in chosen], steps, chunks)
        if not scored:
            return None
        best = max(scored, key=lambda x: x[0])
        centre, width = best[1].at, 3.0
    if best is None or best[0] < 3.0 * np.log(max(fitter.rows, 2.0)) + MARGIN:
        return None
    return best[1]


def _score_steps(
    full: Engine,
    chosen: Sequence[EffectColumns],
    steps: Sequence[BiasStep],
    chunks: Sequence[Chunk],
) -> list[tuple[float, BiasStep]]:
    """Gain of each step alone beside the chosen effects, from one pass with all of them."""
    made = Engine(
        replace(full.settings, refine=False),
        full.prior,
        full.point,
        full.noise,
        more=(*chosen, *steps),
    )
    for chunk in chunks:
        made.add(chunk)
    solution = _solution(made)
    fitter = Fitter(made.all_portions, made.model, max(1.0, solution.chi2), _absent(made))
    stepped = {i for s in steps for i in range(made.model.size) if _within(made, s, i)}
    free = [i for i in range(made.model.size) if i not in stepped]
    before = fitter.fit(free)
    out = []
    for s in steps:
        index = [i for i in range(made.model.size) if _within(made, s, i)]
        after = fitter.fit(free + index)
        if fitter.held_gain(before, after) > 0.0 or len(fitter.portions) < 4:
            out.append((fitter.gain(before, after), s))
    return out


def _within(engine: Engine, columns: EffectColumns, i: int) -> bool:
    where = engine.model.slices[columns.name]
    return bool(where.start <= i < where.stop)


def _still_needed(
    like: Engine, chunks: Sequence[Chunk], families: Sequence[EffectColumns], t0: float
) -> list[EffectColumns]:
    """Families that stay significant when all of them are in one model."""
    made = _engine(like, chunks, families, rounds=2, t0=t0)
    fitter = Fitter(made.all_portions, made.model, _solution(made).inflation, _absent(made))
    kept = list(families)
    for family in list(families):
        free = list(range(made.model.size))
        rest = [
            i
            for i in free
            if not _within(made, family, i)
            and not any(_within(made, f, i) for f in families if f not in kept)
        ]
        with_it = sorted({*rest, *(i for i in free if _within(made, family, i))})
        gain = fitter.gain(fitter.fit(rest), fitter.fit(with_it))
        if gain < len(family.unknowns) * np.log(max(fitter.rows, 2.0)) + MARGIN:
            kept = [f for f in kept if f is not family]
    return kept


def _traces(engine: Engine) -> list[EpochTrace]:
    """One more pass that keeps every row."""
    solution = _solution(engine)
    made = Pass(
        engine.model,
        engine.point,
        (engine.noise,),
        uses=engine.uses,
        traces=True,
        theta=solution.theta,
        covariance=solution.covariance,
    )
    out: list[EpochTrace] = []
    for chunk in engine.chunks:
        out.extend(engine.through(made, chunk).traces)
    return out


class _Judge:
    """Puts the evidence together."""

    def __init__(
        self,
        calibrator: Calibrator,
        imu: int,
        engine: Engine,
        families: Sequence[EffectColumns],
        rivals: dict[str, list[Rival]],
        traces: list[EpochTrace],
        calibration: Calibration,
        told: float,
        origin: Origin,
        absent: list[NotTestable],
        full: Fitter,
        full_base: list[int],
        candidates: list[_Candidate],
    ) -> None:
        self.calibrator, self.imu, self.engine = calibrator, imu, engine
        self.families, self.rivals, self.traces = list(families), rivals, traces
        self.calibration, self.told, self.origin = calibration, told, origin
        self.absent, self.full, self.full_base = absent, full, full_base
        self.candidates = candidates
        self.solution = solve(engine.all_portions, engine.model)
        self.absent_at = _absent(engine)
        self.fitter = Fitter(
            engine.all_portions, engine.model, self.solution.inflation, self.absent_at
        )
        self.index = engine.model.index
        self.all = list(range(engine.model.size))

    def diagnosis(self) -> Diagnosis:
        timing = timing_of(self.engine, self.solution)
        standing = standing_effects(
            timing, self.solution, self.index, self.told, self.calibrator.parameters.trim
        )
        ladder, held = self._ladder()
        before, after = held[0], held[-1]
        effects = [self._standing(n, q, cure, p) for n, (q, cure, p) in standing.items()]
        effects += [self._effect(f) for f in self.families]
        rail = saturation_effect(self.engine.chunks, self.origin.t0)
        fault = fault_effect(
            self.traces,
            self.engine.chunks,
            self.calibrator,
            self.origin.t0,
            self.engine.noise,
            self.engine.settings.coast_s,
        )
        # What a clipped accelerometer integrates to is not the receiver's fault.
        if rail is not None:
            effects.append(rail)
        elif fault is not None:
            effects.append(fault)
        insufficient = not self.calibrator.engine(self.imu).moving
        mismatch = self._mismatch(before, after)
        verdict, note = self._verdict(effects, insufficient=insufficient)
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
            regimes=regime_residuals(self.traces, self.engine.chunks, before.theta, after.theta),
            series=self._series(before.theta, after.theta),
            note=note,
        )

    def _held(self, names: Sequence[str]) -> Array:
        """Unknowns of ``names`` at the value that means *not in the model*."""
        at = self.absent_at.copy()
        if "gps_delay" in names:
            at[self.index["gps_delay"]] = self.told - self.engine.point.delay
        if "window_squared" in names:
            at[self.index["window_squared"]] = -(self.engine.point.window**2)
        if "attitude_delay" in names:
            at[self.index["attitude_delay"]] = -self.engine.point.attitude_delay
        return at

    def _ladder(self) -> tuple[tuple[Rung, ...], list[Fit]]:
        """Six numbers only, + timing (and constant attitude errors), + each effect."""
        timing = ["gps_delay", "window_squared", "attitude_delay"]
        constant = ["tilt_roll", "tilt_pitch", "heading"]
        out = [self.index[n] for n in timing + constant]
        mine = [i for f in self.families for i in self.all if _within(self.engine, f, i)]
        free = [i for i in self.all if i not in out and i not in mine]
        fits = [self.fitter.fit(free, self._held(timing))]
        names = ["six numbers only"]
        free = free + out
        fits.append(self.fitter.fit(free))
        names.append("+ timing and attitude")
        for f in self.families:
            free = free + [i for i in self.all if _within(self.engine, f, i)]
            fits.append(self.fitter.fit(free))
            names.append(f"+ {f.effect}")
        rungs = tuple(
            Rung(name, self.fitter.rms(fit), self.fitter.held_rms(fit))
            for name, fit in zip(names, fits, strict=True)
        )
        return rungs, fits

    def _without(self, index: Sequence[int], held: Array | None = None) -> tuple[Fit, Fit]:
        rest = [i for i in self.all if i not in index]
        return self.fitter.fit(rest, held), self.fitter.fit(self.all)

    def _share(self, without: Fit, with_it: Fit) -> float:
        left = max(without.chi2, 1e-12)
        return float(np.clip((without.chi2 - with_it.chi2) / left, 0.0, 1.0))

    def _standing(
        self, name: str, quantities: dict[str, Quantity], cure: str, parameters: dict[str, float]
    ) -> Effect:
        columns = {
            "gps_latency": ["gps_delay"],
            "gps_smoothing": ["window_squared"],
            "imu_delay": ["attitude_delay"],
            "mount_tilt": ["tilt_roll", "tilt_pitch"],
            "heading_error": ["heading"],
        }[name]
        index = [self.index[c] for c in columns]
        without, with_it = self._without(index, self._held(columns))
        return self._record(name, quantities, index, without, with_it, parameters, cure)

    def _effect(self, f: EffectColumns) -> Effect:
        index = [i for i in self.all if _within(self.engine, f, i)]
        without, with_it = self._without(index)
        sigma = np.sqrt(np.diag(self.solution.covariance))
        taken = {"clock_rate": self.engine.point.skew}
        quantities = {
            key: Quantity(
                float(self.solution.theta[i]) + taken.get(u.name, 0.0), float(sigma[i]), u.unit
            )
            for key, i, u in zip(f.keys, index, f.unknowns, strict=True)
        }
        if isinstance(f, BiasStep):
            quantities = {"time": Quantity(f.at - self.origin.t0, 0.5, "s"), **quantities}
        values = {k: q.value for k, q in quantities.items()}
        made = self._record(
            f.effect, quantities, index, without, with_it, f.parameters(values), f.cure
        )
        return replace(made, rivals=tuple(self.rivals.get(f.name, ())))

    def _record(
        self,
        name: str,
        quantities: dict[str, Quantity],
        index: Sequence[int],
        without: Fit,
        with_it: Fit,
        parameters: dict[str, float],
        cure: str,
    ) -> Effect:
        bic = self.fitter.gain(without, with_it) - len(index) * np.log(max(self.fitter.rows, 2.0))
        return Effect(
            name=name,
            unknowns=quantities,
            share_of_mismatch=self._share(without, with_it),
            delta_bic=-float(bic),
            held_out_before=self.fitter.held_rms(without),
            held_out_after=self.fitter.held_rms(with_it),
            parameters=parameters,
            cure=cure,
            where=located(
                self.fitter.portions,
                self.engine.chunks,
                without.theta,
                with_it.theta,
                self.origin.t0,
            ),
        )

    def _mismatch(self, before: Fit, after: Fit) -> Mismatch:
        n = len(self.all)
        gain = self.fitter.gain(before, after)
        series = self._series(before.theta, after.theta)
        return Mismatch(
            detected=bool(gain > n * np.log(max(self.fitter.rows, 2.0)) + MARGIN),
            whitened_rms_before=self.fitter.rms(before),
            whitened_rms_after=self.fitter.rms(after),
            p_value=float(np.exp(-0.5 * min(max(gain, 0.0), 1400.0))),
            velocity_rms_before=_rms(series.before),
            velocity_rms_after=_rms(series.after),
            held_out_before=self.fitter.held_rms(before),
            held_out_after=self.fitter.held_rms(after),
            where=located(
                self.fitter.portions, self.engine.chunks, before.theta, after.theta, self.origin.t0
            ),
        )

    def _series(self, before: Array, after: Array) -> Series:
        t = np.array([x.t for x in self.traces]) - self.origin.t0
        one, two = (np.full((len(t), 3), np.nan) for _ in range(2))
        for k, x in enumerate(self.traces):
            one[k, : x.velocities] = x.innovation - x.columns @ before
            two[k, : x.velocities] = x.innovation - x.columns @ after
        refused = np.array(["velocity" in x.refused for x in self.traces], dtype=bool)
        return Series(t, one, two, refused)

    def _verdict(self, effects: list[Effect], *, insufficient: bool) -> tuple[Verdict, str]:
        note = self.calibration.note
        if insufficient:
            return Verdict.INSUFFICIENT, "too little excitation to say. " + note
        left = self.solution.inflation > UNEXPLAINED
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

    def _ambiguous(self, effects: list[Effect]) -> tuple[Ambiguity, ...]:
        by_name = {f.effect: f for f in self.families}
        out = []
        for e in effects:
            close = [r.name for r in e.rivals if r.delta_bic < AMBIGUOUS and r.name != e.name]
            if close and e.name in by_name:
                out.append(Ambiguity((e.name, *close), by_name[e.name].apart))
        return tuple(out)

    def _too_weak(self, effects: list[Effect]) -> list[NotTestable]:
        """Effects that this flight could not have shown at any plausible size."""
        named = {e.name for e in effects}
        out: list[NotTestable] = []
        for c in self.candidates:
            if c.columns.effect in named or any(n.name == c.columns.effect for n in out):
                continue
            fit = self.full.fit(self.full_base + c.index)
            sigma = np.sqrt(np.diag(fit.covariance)[c.index])
            if np.all(sigma * SIGNIFICANT > np.array(c.columns.plausible)):
                out.append(
                    NotTestable(
                        c.columns.effect,
                        "this flight would not show it at any plausible size: " + c.columns.apart,
                    )
                )
        return out


def _rms(x: Array) -> float:
    seen = x[np.isfinite(x)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")
