"""Flight that must not be fitted: clipped accelerometers, false GPS velocities.

Both are found before anything else is judged, for what they leave in the sums would be taken for
physics or for noise.  Clipped flight is cut out, the filter begins anew after it; false fixes are
marked as not to be believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.coasting import Contradiction, contradictions
from onboard.core.diagnosis.effort import SHORTEST_S
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.faults import fault_effect, fault_of, suspected
from onboard.core.diagnosis.limits import FAULT_M_S, MARGIN_S, OFF
from onboard.core.diagnosis.refusals import OPINIONS, Refused, refused, within
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.going_through import through
from onboard.core.estimate.limits import DELAY_RANGE_S
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import Traces, residual
from onboard.core.gps.distrust import Distrust
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
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
) -> tuple[Finding | None, bool]:
    """GPS velocities that cannot be true, or may not be.

    Noise levels that were found with the false ones among the rest would let them pass: the
    filter that judges uses what most fixes say of the noise.

    Returns:
        A fault, if there may be one; and whether there is, whatever the likelihood of the flight.
    """
    doubted = doubted_of(calibrator, full)
    levels, least, jumped = _robust(full, full.found().theta)
    full.let_epochs_go()
    every = (full.refused, full.refused_untuned, like.refused)
    rejected = any(refused["velocity"] for refused in every)
    if not rejected and not jumped and not doubted:
        return None, False
    contradicted = contradictions(full, levels, doubted)
    traces = _asked_again(full, levels, contradicted, again=bool(doubted))
    fault = fault_effect(
        traces,
        full.batches,
        t0,
        least,
        full.settings.coast_s,
        _distrusted(calibrator, full, t0),
        contradicted,
    )
    if fault is not None:
        return fault, True
    spans = suspected(traces, t0)
    return (fault_of(full.batches, t0, spans, None, "") if spans else None), False


def unbelieved(full: Examination, fault: Finding, t0: float) -> list[Batch]:
    """The flight with the fixes of a fault not to be believed."""
    out = []
    for batch in full.batches:
        bad = within(full.point.true_time(batch.fixes.t) - t0, fault.intervals)
        out.append(replace(batch, trusted=batch.trusted & ~bad))
    return out


def _asked_again(
    full: Examination, levels: NoiseLevels, known: Sequence[Contradiction], *, again: bool
) -> Traces:
    """Epochs of a pass whose gates judge every fix, their innovations with what was found.

    With ``again`` also those refused in flight.  Not those that are ``known`` to be false: a filter
    would take them for true in the end.
    """
    solution = full.found()
    made = Pass(
        full.model,
        full.point,
        (levels,),
        uses=full.uses,
        traces=True,
        theta=solution.theta,
        covariance=solution.covariance,
    )
    traces = Traces(sum(len(b.fixes) for b in full.batches))
    for batch in full.batches:
        asked = batch
        if again:
            heard = np.all(np.isfinite(batch.fixes.v_n[:, :2]), axis=1)
            t = full.point.true_time(batch.fixes.t)
            asked = replace(batch, trusted=heard & ~within(t, [(c.start, c.end) for c in known]))
        traces.extend(through(made, asked, full.settings.coast_s).traces.at(solution.theta))
    return traces


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


def _robust(full: Examination, theta: Array) -> tuple[NoiseLevels, float, bool]:
    """What most fixes say of the receiver, for false ones are few.

    Returns:
        Noise levels; the error (m/s) that no honest fix has; whether any is far off.
    """
    traces = full.traces
    seen = traces.velocities > 0
    if not seen.any():
        return full.noise, FAULT_M_S, False
    off = np.abs(residual(traces.innovation, traces.columns, theta)[seen, :2])
    usual = 1.4826 * float(np.median(off))
    noise, floor = full.noise, NoiseLevels()
    levels = replace(
        noise,
        velocity=min(noise.velocity, max(floor.velocity, 2.0 * usual)),
        velocity_colour=min(noise.velocity_colour, max(floor.velocity_colour, 2.0 * usual)),
    )
    spread = max(float(np.hypot(levels.velocity, levels.velocity_colour)), usual)
    least = max(FAULT_M_S, OFF * spread)
    return levels, least, float(off.max()) > max(FAULT_M_S, OFF * usual)
