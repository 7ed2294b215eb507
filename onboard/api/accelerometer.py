"""One accelerometer's calibration and what was found in its recording, as arrays and records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from onboard.answers import words
from onboard.answers.advice import Advice
from onboard.answers.answer import Answer
from onboard.answers.calibration_document import advice_document
from onboard.answers.knowledge import seen
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.accelerometer import parameter_names
from onboard.core.maths.arrays import Array
from onboard.core.physics.catalogue import title_of
from onboard.core.physics.finding import Finding, Quantity

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Effect:
    """Physics that was found in a recording and that six numbers do not have.

    Attributes:
        name: as in the catalogue (``gps_latency``, ``gps_lever_arm``, ...).
        title: the same in words.
        recording: in which it was found.
        unknowns: its numbers with sigma and unit, by name.
        share: of the mismatch, 0 to 1; NaN where that says nothing.
        delta_bic: how much better the flight is explained with it; the more negative the surer.
        intervals: when it acts, s since the first inertial sample; empty: all the time.
        formula: of an effect without a name.
        cure: what to do, in words.
        parameters: what would cure it, by the autopilot's names; whether to set them yet is in
            :attr:`Accelerometer.parameters`.
    """

    name: str
    title: str
    recording: str
    unknowns: Mapping[str, Quantity]
    share: float
    delta_bic: float
    intervals: tuple[tuple[float, float], ...]
    formula: str
    cure: str
    parameters: Mapping[str, float]

    @classmethod
    def of(cls, found: Finding, recording: str) -> Effect:
        """An effect as the diagnosis has it."""
        return cls(
            name=found.name,
            title=title_of(found.name),
            recording=recording,
            unknowns=dict(found.unknowns),
            share=found.share_of_mismatch,
            delta_bic=found.delta_bic,
            intervals=found.intervals,
            formula=found.formula,
            cure=found.cure,
            parameters=dict(found.parameters),
        )

    def rows(self) -> list[Row]:
        """One record for each of its numbers."""
        common = {"recording": self.recording, "effect": self.name}
        return [
            {**common, "unknown": name, "value": q.value, "sigma": q.sigma, "unit": q.unit}
            for name, q in self.unknowns.items()
        ]


@dataclass(frozen=True, slots=True, eq=False)
class Accelerometer:
    """The calibration of one accelerometer, ArduPilot's: ``f = scale * (raw - offset)``.

    Arrays of three are x, y, z of the sensor's own axes and cannot be written to; what is not known
    is NaN.

    Attributes:
        imu: which one, from 1.
        status: ``calibrated``, ``collecting``, ``insufficient`` or ``invalid``; only the first may
            be believed.
        scale: (3,) factors.
        offset: (3,) m/s^2.
        scale_sigma: (3,) standard deviations of ``scale``.
        offset_sigma: (3,) of ``offset``, m/s^2, what the gyroscope's axes put into them included.
        covariance: (6, 6) of scale x, y, z and offset x, y, z.
        in_force_scale: (3,) what the autopilot used.
        in_force_offset: (3,) m/s^2.
        in_force_known: whether the recording says so; else scale 1 and offset 0 are taken.
        known: how far each of the six is: ``yes``, ``roughly``, ``together`` (with the other number
            of its axis, as loaded in flight) or ``no``.
        timing: ``gps_delay_s``, ``gps_smoothing_window_s``, ``imu_delay_s``, as far as found, s.
        effects: physics beside the six; of several recordings each names its own.
        parameters: what a parameter file sets, by name: the six that may be set and, of an
            explanation, the cures.
        held_back: why there are no more, by the objection (or the effect) that holds them back.
        trusted_s: time with trusted GPS, s.
        note: what else there is to say, in words.
        names: of the six parameters; empty for another autopilot than ArduPilot.
    """

    imu: int
    status: str
    scale: Array
    offset: Array
    scale_sigma: Array
    offset_sigma: Array
    covariance: Array
    in_force_scale: Array
    in_force_offset: Array
    in_force_known: bool
    known: tuple[str, ...]
    timing: Mapping[str, Quantity]
    effects: tuple[Effect, ...]
    parameters: Mapping[str, float]
    held_back: Mapping[str, str]
    trusted_s: float
    note: str
    names: tuple[str, ...]

    def rows(self) -> list[Row]:
        """One record for each of the six numbers."""
        both = [
            np.concatenate(pair).tolist()
            for pair in (
                (self.in_force_scale, self.in_force_offset),
                (self.scale, self.offset),
                (self.scale_sigma, self.offset_sigma),
            )
        ]
        return [
            {
                "imu": self.imu,
                "status": self.status,
                "number": number,
                "parameter": name,
                "in_force": old,
                "estimate": new,
                "sigma": sigma,
                "known": known,
                "to_set": self.parameters.get(name, float("nan")),
            }
            for number, name, old, new, sigma, known in zip(
                SIX_NAMES, self.names, *both, self.known, strict=True
            )
        ]

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def __repr__(self) -> str:
        return f"<Accelerometer {self.imu}: {self.status}>"

    def _lines(self) -> Iterator[str]:
        yield f"accelerometer {self.imu}: {self.status}"
        yield f"  {'':9}{'in force':>9}{'estimate':>10}{'sigma':>9}  {'known':9}{'to set':>8}"
        for row in self.rows():
            numbers = [_fixed(row[k]) for k in ("in_force", "estimate", "sigma", "to_set")]
            old, new, sigma, chosen = numbers
            yield f"  {row['number']:9}{old:>9}{new:>10}{sigma:>9}  {row['known']:9}{chosen:>8}"
        for name, q in self.timing.items():
            said = words.TIMING.get(name, name.replace("_", " "))
            yield f"  {said} {words.seconds(q.value, q.sigma)}"
        for effect in self.effects:
            yield f"  found: {effect.title} ({effect.name})"
        for why in self.held_back.values():
            yield f"  held back: {why}"


def accelerometer(
    given: Answer,
    advice: Advice | None,
    *,
    autopilot: str,
    recording: str,
    cures: Sequence[Finding] = (),
) -> Accelerometer:
    """An answer as arrays and records.

    Args:
        given: what is known of one accelerometer.
        advice: what of it may be set; None for another autopilot than ArduPilot.
        autopilot: its kind.
        recording: where effects were found that do not say it themselves.
        cures: effects whose parameters the parameter file sets, too.
    """
    c = given.calibration
    told = advice_document(advice, cures)
    return Accelerometer(
        imu=c.imu,
        status=c.status.value,
        scale=fixed_array(c.scale),
        offset=fixed_array(c.offset),
        scale_sigma=fixed_array(c.scale_sigma),
        offset_sigma=fixed_array(c.offset_sigma),
        covariance=fixed_array(c.covariance),
        in_force_scale=fixed_array(c.in_force_scale),
        in_force_offset=fixed_array(c.in_force_offset),
        in_force_known=c.parameters_known,
        known=seen(c),
        timing={name: Quantity(e.value, e.sigma, "s") for name, e in c.timing.items()},
        effects=_effects(given, recording),
        parameters={} if told is None else told.set,
        held_back={} if told is None else told.held_back,
        trusted_s=c.trusted_s,
        note=c.note,
        names=parameter_names(c.imu).six if autopilot == "ardupilot" else ("",) * 6,
    )


def fixed_array(given: ArrayLike) -> Array:
    """Numbers that cannot be written to."""
    out = np.array(given, dtype=np.float64)
    out.flags.writeable = False
    return out


def _effects(given: Answer, recording: str) -> tuple[Effect, ...]:
    """Those of the recording, or of each of several."""
    if not given.flights:
        return tuple(Effect.of(e, recording) for e in given.diagnosis.effects)
    return tuple(
        Effect.of(e, flight.name)
        for flight in given.flights
        if flight.given is not None
        for e in flight.given.diagnosis.effects
    )


def _fixed(value: float) -> str:
    return f"{value:.4f}" if math.isfinite(value) else "-"
