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
from onboard.core.diagnosis.felt import Asked, felt, mean_walk_s
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.records import NotTestable, Unused
from onboard.core.diagnosis.refusals import Refused, contradicted, repeated, unused_flight
from onboard.core.diagnosis.screening import false_fixes, heard, misled, unbelieved, unclipped
from onboard.core.diagnosis.testability import testable_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.inputs.limits import WALK_SHARE
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.spikes import Spikes, spikes_of
from onboard.core.model.regressors import Family
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Effect, Origin
from onboard.core.physics.finding import Finding

CUT = "the accelerometer clipped nearly all the time, which changes the force as well"


@dataclass(frozen=True, slots=True)
class Cleared:
    """A flight without what must not be fitted, with every effect that it can be asked for.

    ``clipped`` if the accelerometer clipped nearly all the time, and nothing was left out;
    ``sampled`` is the flight before anything was expected of its samples.  ``heard`` is what is
    believed of it although the autopilot's filter gave its receiver up, ``at_odds`` where that is
    far from the accelerometer in any model.  ``blows`` is where the samples may have missed one,
    s since the first sample; it is left out.
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
    heard: tuple[Refused, ...] = ()
    at_odds: tuple[Unused, ...] = ()
    blows: tuple[tuple[float, float], ...] = ()

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
    asked = Asked(engine, testable, origin.t0, carried, beside)
    full = felt(asked, batches)
    spikes: Finding | None = None
    if rail is None:
        full, batches, spikes = _without_spikes(asked, batches, full)
    sampled, batches = batches, full.batches
    fault: Finding | None = None
    blows: tuple[tuple[float, float], ...] = ()
    if not clipped:
        # Of an accelerometer that clips all the time, nobody can say whether a fix is true.
        fault, blows = false_fixes(calibrator, engine, full, origin.t0)
    left = unclipped(sampled, blows, origin.t0) if blows else []
    if sum(batch.trusted_s for batch in left) >= WORTH_S:
        sampled, full = left, felt(asked, left)
    else:
        blows = ()
    if fault is not None:
        believed, false = misled(unbelieved(full, full.batches, fault, origin.t0), fault, origin.t0)
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
    return Cleared(full, testable, absent, rail, fault, spikes, said, clipped, sampled, blows=blows)


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
    asked: Asked, batches: Sequence[Batch], full: Examination
) -> tuple[Examination, Sequence[Batch], Finding | None]:
    """The flight without samples that its velocities know nothing of, or as it is.

    Likelihoods at their highest are compared, and noise and timing may have several of them.  So
    they are looked for from where the flight as it was read has them, too; not only from there, for
    what smooths may have been found for the sake of these very samples.
    """
    spiked = spikes_of(batches)
    if spiked is None or not _matter(spiked, batches, full, asked.engine):
        return full, batches, None
    starts = (asked, replace(asked, beside=full))
    without = max((felt(a, spiked.batches) for a in starts), key=lambda e: e.log_likelihood)
    better = 2.0 * (without.log_likelihood - full.log_likelihood)
    if better <= CLEARLY:
        return full, batches, None
    return without, spiked.batches, spikes_effect(spiked, better, asked.t0)


def _matter(spikes: Spikes, as_read: Sequence[Batch], full: Examination, engine: Engine) -> bool:
    """Whether velocities seem to be likelier without some samples, at a glance.

    That is, of the six and the receiver's delay alone, with the noise that was found, and nothing
    that smooths: a span or an antenna may have been found for the sake of these very samples.
    """
    if spikes.walk**2 < WALK_SHARE * np.max(mean_walk_s(full.noise, spikes.batches)):
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


def unused_of(
    clear: Cleared,
    flight: Sequence[Batch],
    calibrator: Calibrator,
    origin: Origin,
    final: Examination,
) -> tuple[Unused, ...]:
    """Flight whose fixes, or whose readings of an accelerometer, were not used.

    Args:
        clear: the flight without what must not be fitted.
        flight: all of it.
        calibrator: has seen it.
        origin: what effects count from.
        final: the model that stands.
    """
    t0, imu = origin.t0, origin.imu
    refusals, asked = calibrator.trust.refusals, not clear.clipped
    far = [(u.start_s, u.end_s) for u in clear.at_odds]
    far += clear.fault.intervals if clear.fault is not None else ()
    return (
        *unused_flight(heard(flight, clear.heard), refusals, far, t0, asked=asked),
        *contradicted(final.batches, final.refused_velocities(), clear.fault, t0),
        *repeated([s for s in calibrator.stuck(imu) if s[1] >= t0], t0),
    )


def since_reboot(batches: Sequence[Batch], since: float = -np.inf) -> list[Batch]:
    """The batches at the end whose clock is one and the same, of them those from ``since`` (s)."""
    first = 0
    for i in range(1, len(batches)):
        if batches[i].fixes.t[0] < batches[i - 1].fixes.t[0]:
            first = i
    return [batch for batch in batches[first:] if batch.fixes.t[0] >= since]
