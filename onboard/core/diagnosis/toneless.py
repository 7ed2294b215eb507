"""Which tones of a flight its receiver knows nothing of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import CLEARLY, LEFT_OF_TONE, MOST_TONES
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.traces import residual
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.tones import Tone, stretches_of, tones_of, without


def unseen(full: Examination, batches: Sequence[Batch]) -> list[Tone]:
    """Tones without which velocities are likelier, one after the other.

    In the order of their kinds, of each those first that the velocity has most of if they are real.
    Nothing is asked of what not even the best receiver could tell, nor of what is more than is left
    of the velocity: that one has been seen.
    """
    fixes, count = sum(len(batch.fixes) for batch in batches), max(stretches_of(batches), 1)
    told, left = CLEARLY * LIMITS["velocity"][0] ** 2, LEFT_OF_TONE * _left(full)
    asked = []
    for tone in tones_of(batches):
        mean = tone.variance * len(tone.lines) / count
        if fixes * mean > told and mean < left:
            asked.append((tone.kind, -mean, tone))
    asked = sorted(asked, key=lambda one: one[:2])[:MOST_TONES]
    found: list[Tone] = []
    best = _at_a_glance(full, batches) if asked else 0.0
    for *_, tone in asked:
        now = _at_a_glance(full, without(batches, [*found, tone]))
        if 2.0 * (now - best) > CLEARLY:
            found, best = [*found, tone], now
    return found


def _at_a_glance(full: Examination, batches: Sequence[Batch]) -> float:
    """Log-likelihood of the velocities of a flight with other samples, noise as it was found.

    With every effect: of a tone that is nothing beside a drift, only what is left tells.
    """
    made = Examination(
        full, full.families, t0=full.point.skew_from, batches=batches, start=full, traced=False
    )
    made.once()
    return made.log_likelihood


def _left(full: Examination) -> float:
    """(m/s)^2, mean square of what is left of velocities."""
    traces = full.traces
    off = residual(traces.innovation, traces.columns, full.found().theta)
    return float(np.mean(np.nansum(off**2, axis=1))) if len(off) else 0.0
