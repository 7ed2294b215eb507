"""A flight without what must not be fitted: clipped samples, false fixes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.clipping import cut_off, saturation_effect
from onboard.core.diagnosis.coarse_readings import coarse_of
from onboard.core.diagnosis.effort import WORTH_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.false_samples import spikes_effect
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.records import NotTestable
from onboard.core.diagnosis.screening import false_fixes, misled, unbelieved, unclipped
from onboard.core.diagnosis.testability import testable_of
from onboard.core.diagnosis.toneless import unseen
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.shaken import walk_s
from onboard.core.inputs.expected_force import (
    drowned,
    expected,
    shaped,
    spectrum,
    white,
)
from onboard.core.inputs.limits import WALK_SHARE
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.spikes import Spikes, spikes_of
from onboard.core.inputs.tones import density_of, stretches_of, without
from onboard.core.maths.arrays import Array
from onboard.core.model.regressors import Family
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.finding import Finding

CUT = "the accelerometer clipped nearly all the time, which changes the force as well"


@dataclass(frozen=True, slots=True)
class Cleared:
    """A flight without what must not be fitted, with every effect that it can be asked for.

    ``clipped`` if the accelerometer clipped nearly all the time, and nothing was left out;
    ``sampled`` is the flight before anything was expected of its samples.
    """

    full: Examination
    testable: list[Effect]
    absent: list[NotTestable]
    rail: Finding | None
    fault: Finding | None
    spikes: Finding | None
    coarse: Finding | None
    clipped: bool
    sampled: Sequence[Batch]

    @property
    def as_sampled(self) -> tuple[Batch, ...]:
        """The flight without what is false, with its samples and not what to expect of them."""
        pairs = zip(self.sampled, self.full.batches, strict=True)
        return tuple(replace(b, trusted=believed.trusted) for b, believed in pairs)

    @property
    def seen(self) -> tuple[Finding | None, ...]:
        """What is seen in the data themselves."""
        return self.rail, self.fault, self.spikes, self.coarse


def cleared(
    calibrator: Calibrator,
    engine: Engine,
    flight: list[Batch],
    origin: Origin,
    beside: Examination | None = None,
) -> Cleared:
    """Leave out what was clipped and which fixes are false, for no sums may hold them.

    Args:
        calibrator: has seen the flight.
        engine: of the accelerometer.
        flight: what is examined of it.
        origin: what effects count from.
        beside: another accelerometer's examination of the same flight; None: the first.
    """
    rail = saturation_effect(flight, origin.t0)
    left = flight if rail is None else _unclipped(flight, rail, origin.t0)
    clipped = left is None
    batches: Sequence[Batch] = flight if left is None else left
    testable, absent = testable_of(catalogue(origin), batches)
    if rail is not None:
        bent = {
            f.effect: f.bent_by_clipping or (CUT if clipped and f.changes_force else "")
            for f in testable
        }
        absent += [NotTestable(name, why) for name, why in bent.items() if why]
        testable = [f for f in testable if not bent[f.effect]]
    coarse = coarse_of(batches, calibrator.parameters.six(origin.imu))
    carried: tuple[Family, ...] = () if coarse is None else (coarse.conversion,)
    asked = _Asked(engine, testable, origin.t0, carried, beside)
    full = _felt(asked, batches)
    spikes: Finding | None = None
    if rail is None:
        full, batches, spikes = _without_spikes(asked, batches, full)
    sampled, batches = batches, full.batches
    fault: Finding | None = None
    if not clipped:
        # Of an accelerometer that clips all the time, nobody can say whether a fix is true.
        fault = false_fixes(calibrator, engine, full, origin.t0)
    if fault is not None:
        believed, false = misled(unbelieved(full, fault, origin.t0), fault, origin.t0)
        full = Examination(
            engine,
            testable,
            t0=origin.t0,
            batches=believed,
            start=full,
            carried=(*carried, *false),
        ).with_noise()
    full.let_epochs_go()
    said = None if coarse is None else coarse.finding
    return Cleared(full, testable, absent, rail, fault, spikes, said, clipped, sampled)


def _unclipped(flight: list[Batch], rail: Finding, t0: float) -> list[Batch] | None:
    """The flight without what was clipped at all, else without what may matter; None: too little.

    What is left of it may say little, but no wrong number.
    """
    for spans in (rail.intervals, cut_off(flight, t0)):
        left = unclipped(flight, spans, t0) if spans else flight
        if sum(batch.trusted_s for batch in left) >= WORTH_S:
            return left
    return None


def _without_spikes(
    asked: _Asked, batches: Sequence[Batch], full: Examination
) -> tuple[Examination, Sequence[Batch], Finding | None]:
    """The flight without samples that its velocities know nothing of, or as it is."""
    spiked = spikes_of(batches)
    if spiked is None or not _matter(spiked, batches, full, asked.engine):
        return full, batches, None
    without = _felt(asked, spiked.batches)
    better = 2.0 * (without.log_likelihood - full.log_likelihood)
    if better <= CLEARLY:
        return full, batches, None
    return without, spiked.batches, spikes_effect(spiked, better, asked.t0)


def _matter(spikes: Spikes, as_read: Sequence[Batch], full: Examination, engine: Engine) -> bool:
    """Whether velocities seem to be likelier without some samples, at a glance.

    That is, of the six and the receiver's delay alone, with the noise that was found, and nothing
    that smooths: a span or an antenna may have been found for the sake of these very samples.
    """
    if spikes.walk**2 < WALK_SHARE * np.max(_walk_s(full.noise, spikes.batches)):
        return False
    plain = replace(full.point, window=0.0, shapes=(0.0,) * 4, antenna=(0.0,) * 3)
    told = []
    for batches in (spikes.batches, as_read):
        t0 = full.point.skew_from
        made = Examination(
            engine, (), t0=t0, batches=batches, start=full, point=plain, traced=False
        )
        made.once()
        told.append(made.log_likelihood)
    return 2.0 * (told[0] - told[1]) > CLEARLY


@dataclass(frozen=True, slots=True)
class _Asked:
    """Of a flight: whose sensor's, with which effects from when on, what else there is."""

    engine: Engine
    testable: Sequence[Effect]
    t0: float
    carried: Sequence[Family]
    beside: Examination | None

    def examined(self, batches: Sequence[Batch], start: Examination | None = None) -> Examination:
        """The flight with its own noise and timing, which are looked for from those of ``start``.

        Else from those of the accelerometer beside it: it has flown the same flight with the same
        receiver, and a search takes a third of the passes from there.  Else from where they are
        likeliest with nothing but scale, offset and timing: with every effect at once, a search
        that knows nothing yet is led away by what effects make up for, and does not come back.  A
        heading that seemed worse than usual may have been one of them, though.
        """
        plain = self.plain(batches) if start is None and self.beside is None else None
        start = start or plain
        made = Examination(
            self.engine,
            self.testable,
            t0=self.t0,
            batches=batches,
            start=start,
            carried=self.carried,
        )
        if plain is not None and plain.noise != (usual := plain.noise.with_usual_heading):
            made.noise = usual
            made.with_rows()  # what it is linear about would pass for noise
        if start is None and self.beside is not None:
            made.begin_as(self.beside)
        return made.with_noise()

    def plain(self, batches: Sequence[Batch]) -> Examination:
        """The flight without any effect, noise and timing at their likeliest; no sums."""
        made = Examination(
            self.engine, (), t0=self.t0, batches=batches, carried=self.carried, traced=False
        )
        made.tune()
        return made


def _felt(asked: _Asked, batches: Sequence[Batch]) -> Examination:
    """A flight examined with the force that its samples let one expect, or as it was sampled.

    What may be noise in the samples may be real, too: of noise there is no more than the velocity
    walks by, and the flight is taken as its velocity is likelier.  So it is with a tone.  Where
    noise moves one of the six, it may be white to the end of the spectrum, or a low-pass has shaped
    it.
    """
    sampled = asked.examined(batches)
    density = spectrum(batches)
    if density is None:
        return sampled
    tones = unseen(sampled, batches)
    if tones:
        toneless = asked.examined(without(batches, tones), sampled)
        if toneless.log_likelihood > sampled.log_likelihood:
            tone = density_of(tones, density, stretches_of(batches))
            sampled, batches = toneless, toneless.batches
            density = np.maximum(density - tone, np.min(density, axis=0))
    little = np.all(white(density) <= LIMITS["force_walk"][0] ** 2) and not sampled.found_noisy
    if little and not drowned(batches, density):
        return sampled
    walk = _walk_s(sampled.noise, batches)
    kinds = [np.minimum(white(density), walk)]
    if sampled.found_noisy and np.any(walk > white(density)):
        kinds.append(shaped(density, walk))
    found = [asked.examined(expected(batches, density, noise), sampled) for noise in kinds]
    return max(sampled, *found, key=lambda made: made.log_likelihood)


def _walk_s(levels: NoiseLevels, batches: Sequence[Batch]) -> Array:
    """(3,) variance by which the velocity walks in a second of all batches, (m/s)^2."""
    out: Array = np.mean([walk_s(levels, batch.segment) for batch in batches], axis=0)
    return out


def since_reboot(batches: Sequence[Batch], since: float = -np.inf) -> list[Batch]:
    """The batches at the end whose clock is one and the same, of them those from ``since`` (s)."""
    first = 0
    for i in range(1, len(batches)):
        if batches[i].fixes.t[0] < batches[i - 1].fixes.t[0]:
            first = i
    return [batch for batch in batches[first:] if batch.fixes.t[0] >= since]
