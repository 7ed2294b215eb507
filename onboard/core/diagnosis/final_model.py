"""The model that was chosen, with its sums: all that is asked of them to say what was found."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np

from onboard.core.diagnosis.candidates import Candidate
from onboard.core.diagnosis.epochs import Epochs, rms
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.nuisance_effects import (
    constant_unknowns,
    nuisance_kinds,
    timing_unknowns,
    without,
)
from onboard.core.diagnosis.records import Rung, Series
from onboard.core.diagnosis.regimes import Residuals, axis_of, located
from onboard.core.diagnosis.score import least
from onboard.core.diagnosis.selection import Fit, Fitter
from onboard.core.estimate.calibration_record import timing_of
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import Array
from onboard.core.model.nuisances import LeverArmError
from onboard.core.physics.effect import Effect, NuisanceFit, Origin
from onboard.core.physics.finding import Where


class FinalModel:
    """The last examination of a flight, its solution, and its fits with and without parts.

    Attributes:
        engine: the examination.
        families: effects that are in it with regressors of their own.
        origin: what effects count from.
        clock: what the recording's fixes are stamped with.
        solution: of all unknowns, (m,).
        fitter: fits of subsets of the unknowns.
        epochs: residuals of any unknowns at every fix.
        index: place of each unknown by name; ``all`` are the places.
    """

    def __init__(
        self,
        engine: Examination,
        families: Sequence[Effect],
        origin: Origin,
        parameters: ParametersInForce,
    ) -> None:
        """Take the examination, its effects, what they count from, the autopilot's parameters."""
        self.engine, self.families, self.origin = engine, list(families), origin
        self.parameters = parameters
        self.clock = fix_clock(parameters, engine.batches)
        self.epochs = Epochs.of(engine.traces, engine.all_blocks)
        self.solution = engine.found()
        self.fitter = Fitter(engine.all_blocks, engine.model, engine.absent)
        self.index = engine.model.index
        self.all = list(range(engine.model.size))
        self._axes = self._body_axes()

    @cached_property
    def as_seen(self) -> FinalModel:
        """The same beside slow errors of which no more lasts than was seen."""
        return FinalModel(self.engine.as_seen(), self.families, self.origin, self.parameters)

    def that_tells(self, kind: type[Effect]) -> FinalModel:
        """The model by which an effect is told that is in every model."""
        return self.as_seen if kind.lasts else self

    def nuisances(self, imu: int) -> NuisanceFit:
        """The unknowns of every model, as effects measure themselves by them."""
        return NuisanceFit(
            timing=timing_of(self.engine, self.solution),
            theta=self.solution.theta,
            sigma=np.sqrt(np.diag(self.solution.covariance)),
            index=self.index,
            point=self.engine.point,
            parameters=self.parameters,
            imu=imu,
            clock=self.clock,
        )

    def _body_axes(self) -> dict[int, str]:
        """Body axis of each column that acts on one."""
        keys = {i: name.rsplit("_", 1)[-1] for name, i in self.index.items() if i < 6}
        keys |= {self.index["tilt_roll"]: "roll", self.index["tilt_pitch"]: "pitch"}
        for f in self.families:  # which have no keys for their shapes
            keys |= dict(zip(self.engine.indices(f), f.keys, strict=False))
        return {i: axis for i, key in keys.items() if (axis := axis_of(key)) is not None}

    def held(self, names: Sequence[str]) -> Array:
        """Unknowns of ``names`` at the value that means *not in the model*."""
        told = self.clock.configured_on_stamp
        return without(names, self.index, self.engine.point, self.engine.absent, told)

    def ladder(self) -> tuple[tuple[Rung, ...], list[Fit]]:
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
                    self.held_velocity(free, held),
                )
            )

        climb("six numbers only", self.held([*timing, *constant]))
        free = free + late
        climb("+ timing", self.held(constant))
        free = free + turned
        climb("+ attitude")
        for f in self.families:
            free = free + self.engine.indices(f)
            climb(f"+ {f.effect}")
        return tuple(rungs), fits

    def without(self, index: Sequence[int], held: Array | None = None) -> tuple[Fit, Fit]:
        """Fits without the unknowns ``index``, held at (m,) ``held``, and with all."""
        rest = [i for i in self.all if i not in index]
        return self.fitter.fit(rest, held), self.fitter.fit(self.all)

    def score(self, name: str, among: Sequence[int]) -> float:
        """Of timing or a constant attitude error, beside the other columns ``among``."""
        columns = nuisance_kinds()[name].in_every_model
        target = Candidate(name, tuple(self.index[c] for c in columns), ())
        rest = [i for i in among if i not in target.index]
        absent, with_it = self.fitter.fit(rest, self.held(columns)), self.fitter.fit(among)
        return target.score(self.fitter, absent, with_it)

    def holds(self, name: str, among: Sequence[int] | None = None) -> bool:
        """Whether timing or a constant attitude error is no chance beside others; None: all."""
        return self.score(name, self.all if among is None else among) >= least()

    @staticmethod
    def share(without: Fit, with_it: Fit) -> float:
        """What share of a misfit an effect takes away."""
        left = max(without.chi2, 1e-12)
        return float(np.clip((without.chi2 - with_it.chi2) / left, 0.0, 1.0))

    def with_configured_antenna(self) -> list[int]:
        """All places but those of the antenna's: it is where the autopilot was told."""
        place = self.engine.model.slices.get(LeverArmError.name, slice(0, 0))
        return [i for i in self.all if not place.start <= i < place.stop]

    def where(self, index: Sequence[int], before: Array, after: Array) -> tuple[Where, ...]:
        """Where the residual falls when the columns ``index`` are added."""
        series = self.series(before, after)
        return located(
            self.fitter.blocks,
            self.engine.batches,
            before,
            after,
            self.origin.t0,
            {i: self._axes[i] for i in index if i in self._axes},
            Residuals(series.t + self.origin.t0, series.before, series.after),
        )

    def series(self, before: Array, after: Array) -> Series:
        """Velocity residuals of two sets of unknowns, (m,) each, at every fix."""
        e = self.epochs
        return Series(e.t - self.origin.t0, e.residual(before), e.residual(after), e.refused)

    def held_velocity(self, free: Sequence[int], held: Array | None = None) -> float:
        """Velocity residual, m/s, on blocks that a fit of ``free`` has not seen."""
        return self.epochs.held_out_rms(self.fitter.held_fits(free, held))

    def places_of(self, names: Collection[str]) -> list[int]:
        """Places of the unknowns of effects; of the calibration parameters where there is none."""
        nuisances = nuisance_kinds().items()
        out = [self.index[u] for n, k in nuisances if n in names for u in k.in_every_model]
        out += self.engine.indices_of([f for f in self.families if f.effect in names])
        return out or list(range(6))
