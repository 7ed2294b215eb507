"""Flight that must not be fitted: clipped accelerometers, false GPS velocities.

Both are found before anything else is judged, for what they leave in the sums would be taken for
physics or for noise.  Clipped flight is cut out, the filter begins anew after it; false fixes are
marked as not to be believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log

import numpy as np

from onboard.core.diagnosis.effort import SEARCHED, SHORTEST_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.faults import fault_effect
from onboard.core.diagnosis.limits import MARGIN_S
from onboard.core.diagnosis.receiver_errors import Looking
from onboard.core.diagnosis.refusals import OPINIONS, Refused, refused, within
from onboard.core.diagnosis.score import surprise
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.traces import residual
from onboard.core.gps.distrust import Distrust
from onboard.core.inputs.limits import DELAY_RANGE_S
from onboard.core.inputs.segments import Batch
from onboard.core.model.ekf_misled import EkfMisled
from onboard.core.physics.finding import Finding


def unclipped(
    batches: Sequence[Batch], intervals: Sequence[tuple[float, float]], t0: float
) -> list[Batch]:
    """The flight without the clipped parts; the filter begins anew after each.

    Args:
        batches: the flight.
        intervals: clipped, s since ``t0``.
        t0: s on the boot clock.
    """
    out: list[Batch] = []
    torn = False
    for batch in batches:
        t = batch.fixes.t - t0
        bad = np.zeros(len(t), dtype=bool)
        for a, b in intervals:
            bad |= (t >= a - MARGIN_S) & (t <= b + MARGIN_S + DELAY_RANGE_S[1])
            # An interval between two fixes spoils what is integrated from one to the other.
            inside = np.flatnonzero((t[:-1] < b) & (t[1:] > a))
            bad[inside + 1] = True
        cuts = np.flatnonzero(np.diff(bad.astype(int))) + 1
        for piece in np.split(np.arange(len(t)), cuts):
            if bad[piece[0]]:
                torn = True
                continue
            first, last = int(piece[0]), int(piece[-1]) + 1
            if last - first < 2 or t[last - 1] - t[first] < min(SHORTEST_S, t[-1] - t[0]):
                torn = True
                continue
            out.append(
                Batch(
                    batch.segment,
                    batch.fixes.between(first, last),
                    batch.trusted[first:last],
                    batch.fresh or torn or first > 0,
                )
            )
            torn = last < len(t)
    return out


def doubted_of(calibrator: Calibrator, full: Examination) -> list[Refused]:
    """Where others doubted a receiver that had a fix."""
    return [r for r in refused(full.batches, calibrator.trust.refusals) if r.reason in OPINIONS]


def false_fixes(
    calibrator: Calibrator, like: Engine, full: Examination, t0: float
) -> tuple[Finding | None, tuple[tuple[float, float], ...]]:
    """GPS velocities that cannot be true, and where a blow may have been missed, s since ``t0``.

    Those that others doubted in flight are asked, too: that was an opinion.  Noise levels that were
    found with the false ones among the rest would let them pass: what most fixes say of the noise
    is what they are judged by.
    """
    doubted = doubted_of(calibrator, full)
    noise, suspicious = _of_most(full)
    full.let_epochs_go()
    refused = (full.refused, full.refused_untuned, like.refused)
    if not (suspicious or doubted or any(by["velocity"] for by in refused)):
        return None, ()
    looking = Looking(full, heard(full.batches, doubted), noise)
    fault = fault_effect(looking.errors(), _distrusted(calibrator, full, t0), full.batches, t0)
    return fault, tuple((a - t0, b - t0) for a, b in looking.blows)


def heard(batches: Sequence[Batch], doubted: Sequence[Refused]) -> list[Batch]:
    """The flight with the velocities believed that others doubted (stamps, s on the boot clock)."""
    out, stretches = [], [(r.start, r.end) for r in doubted]
    for batch in batches:
        inside = within(batch.fixes.t, stretches)
        inside &= np.all(np.isfinite(batch.fixes.v_n[:, :2]), axis=1)
        out.append(replace(batch, trusted=batch.trusted | inside))
    return out


def unbelieved(
    made: Examination, batches: Sequence[Batch], fault: Finding, t0: float
) -> list[Batch]:
    """Flight with the fixes of a fault not to be believed, by the timing of an examination."""
    out = []
    for batch in batches:
        bad = within(made.point.true_time(batch.fixes.t) - t0, fault.intervals)
        out.append(replace(batch, trusted=batch.trusted & ~bad))
    return out


def misled(
    batches: Sequence[Batch], fault: Finding, t0: float
) -> tuple[list[Batch], tuple[EkfMisled, ...]]:
    """The flight with what its EKF may have made of false velocities, and columns of it.

    Of those that nothing says the size of there are none.
    """
    size = fault.unknowns.get("offset")
    if size is None:
        return list(batches), ()
    columns = EkfMisled([(a + t0, b + t0) for a, b in fault.intervals], size.value)
    return columns.along(batches), (columns,)


def _distrusted(calibrator: Calibrator, full: Examination, t0: float) -> list[tuple[float, float]]:
    """When the receiver contradicted itself, if it did so for long; s since ``t0``.

    One contradiction closes the window for the recovery time: a hard landing makes one.
    """
    t = np.concatenate([c.fixes.t for c in full.batches])
    bad = np.concatenate([~c.trusted for c in full.batches])
    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    closed = step * calibrator.trust.rejected.get("gps_glitch", 0)
    if closed <= 2.0 * calibrator.settings.trust.recovery[Distrust.GPS_GLITCH]:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(int)))
    spans = zip(t[edges[::2]], t[edges[1::2] - 1], strict=True)
    return [(float(a) - t0, float(b) - t0) for a, b in spans if b - a > 1.0]


def _of_most(full: Examination) -> tuple[NoiseLevels, bool]:
    """Noise levels of the receiver by most of its fixes; whether any is off by what is no chance.

    The median of what they are off by does not know of a few that are false.
    """
    traces, noise = full.traces, full.noise
    seen = traces.velocities > 0
    if not seen.any():
        return noise, False
    off = residual(traces.innovation, traces.columns, full.found().theta)[seen, :2]
    usual = max(1.4826 * float(np.median(np.abs(off))), LIMITS["velocity"][0])
    largest, floor = float(np.max(np.sum(off**2, axis=1))), NoiseLevels()
    levels = replace(
        noise,
        velocity=min(noise.velocity, max(floor.velocity, 2.0 * usual)),
        velocity_colour=min(noise.velocity_colour, max(floor.velocity_colour, 2.0 * usual)),
    )
    return levels, surprise(largest / usual**2, 2, len(off)) > -2.0 * log(SEARCHED)
