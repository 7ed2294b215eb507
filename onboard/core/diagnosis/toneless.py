"""Which tones of a flight its receiver knows nothing of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import CLEARLY, LEFT_OF_TONE, MOST_TONES
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.traces import residual
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.tones import PARTS, Tone, stretches_of, tones_of, with_parts
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import total
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Unknown


class Tones(Family):
    """Of each tone, how much is no force: none of it or all."""

    name = "tones"

    def __init__(self, tones: Sequence[Tone]) -> None:
        """Take the tones, which segments have as a slow signal."""
        self.unknowns = tuple(Unknown(f"tone_{i}", "1", 0.0, 1.0) for i in range(len(tones)))
        self._axes = [tone.axis for tone in tones]

    def available(self, nodes: Signals) -> bool:
        """True where it was worked out what they have of the samples."""
        return PARTS in nodes.segment.slow

    def acceleration(self, nodes: Signals) -> Array | None:
        """What is no force is less of it."""
        parts = nodes.slow(PARTS)
        return None if parts is None else -nodes.R_bs[:, self._axes] * parts[..., None, :]


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
    tones = [tone for *_, tone in sorted(asked, key=lambda one: one[:2])[:MOST_TONES]]
    return [tones[i] for i in _likelier_without(full, batches, tones)] if tones else []


def _likelier_without(
    full: Examination, batches: Sequence[Batch], tones: Sequence[Tone]
) -> list[int]:
    """Which of some tones velocities are clearly likelier without, each beside those before it.

    By one pass with a column for each, beside every effect, noise as it was found: of a tone that
    is nothing beside a drift, only what is left tells.
    """
    family = Tones(tones)
    made = Examination(
        full,
        (*full.families, family),
        t0=full.point.skew_from,
        batches=with_parts(batches, tones),
        start=full,
        traced=False,
    )
    made.once()
    sums, model = total(made.blocks), made.model
    own = made.indices(family)
    rest = [i for i in range(model.size) if i not in own]
    information = 1.0 / model.prior_sigma[rest] ** 2
    # Everything else is fitted anew beside whatever is taken off.
    gone = np.linalg.solve(sums.N[np.ix_(rest, rest)] + np.diag(information), sums.N[rest][:, own])
    slope = sums.b[own] - gone.T @ (sums.b[rest] + information * model.prior[rest])
    bend = sums.N[np.ix_(own, own)] - sums.N[own][:, rest] @ gone
    found: list[int] = []
    for i in range(len(tones)):
        if 2.0 * slope[i] - bend[i, i] - 2.0 * bend[i, found].sum() > CLEARLY:
            found.append(i)
    return found


def _left(full: Examination) -> float:
    """(m/s)^2, mean square of what is left of velocities."""
    traces = full.traces
    off = residual(traces.innovation, traces.columns, full.found().theta)
    return float(np.mean(np.nansum(off**2, axis=1))) if len(off) else 0.0
