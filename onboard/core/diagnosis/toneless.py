"""Which tones of a flight its receiver knows nothing of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import CLEARLY, MOST_TONES
from onboard.core.estimate.engine import Engine
from onboard.core.filter.limits import LIMITS
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.tones import Tone, stretches_of, tones_of, without


def unseen(engine: Engine, full: Examination, batches: Sequence[Batch]) -> list[Tone]:
    """Tones without which velocities are likelier, one after the other.

    First those of a part of the flight, then what the whole of it has besides; of either those
    first that the velocity has most of if they are real.  Of what not even the best receiver could
    tell, nothing is asked.
    """
    told, fixes = LIMITS["velocity"][0], sum(len(batch.fixes) for batch in batches)
    each = fixes / max(stretches_of(batches), 1)
    by_worth = [
        (each * len(tone.lines) * tone.variance / told**2, tone) for tone in tones_of(batches)
    ]
    asked = [(tone.whole, -worth, tone) for worth, tone in by_worth if worth > CLEARLY]
    asked = sorted(asked, key=lambda one: one[:2])[:MOST_TONES]
    found: list[Tone] = []
    best = at_a_glance(engine, full, batches) if asked else 0.0
    for *_, tone in asked:
        now = at_a_glance(engine, full, without(batches, [*found, tone]))
        if 2.0 * (now - best) > CLEARLY:
            found, best = [*found, tone], now
    return found


def at_a_glance(engine: Engine, full: Examination, batches: Sequence[Batch]) -> float:
    """Log-likelihood of the velocities of a flight with other samples.

    That is, of the six and the receiver's delay alone, with the noise that was found, and nothing
    that smooths: a span or an antenna may have been found for the sake of these very samples.
    """
    plain = replace(full.point, window=0.0, shapes=(0.0,) * 4, antenna=(0.0,) * 3)
    made = Examination(
        engine, (), t0=full.point.skew_from, batches=batches, start=full, point=plain, traced=False
    )
    made.once()
    return made.log_likelihood
