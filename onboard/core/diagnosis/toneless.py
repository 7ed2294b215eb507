"""Which tones of a flight its receiver knows nothing of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.limits import CLEARLY, LEFT_OF_TONE, MOST_TONES
from onboard.core.filter.accompanied import NO_PART
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.traces import residual
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.tones import PARTS, Tone, stretches_of, tones_of, with_parts
from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Model, Unknown


class Tones(Family):
    """Of each tone, how much is no force: none of it or all."""

    name = "tones"

    def __init__(self, tones: Sequence[Tone]) -> None:
        """Take the tones, which segments have as a slow signal."""
        self.unknowns = tuple(Unknown(f"tone_{i}", "1", 0.0, NO_PART) for i in range(len(tones)))
        self._axes = [tone.axis for tone in tones]

    def available(self, nodes: Signals) -> bool:
        """True where it was worked out what they have of the samples."""
        return PARTS in nodes.segment.slow

    def acceleration(self, nodes: Signals) -> Array | None:
        """What is no force is less of it."""
        parts = nodes.slow(PARTS)
        return None if parts is None else -nodes.R_bs[:, self._axes] * parts[..., None, :]


@dataclass(frozen=True, slots=True)
class Beside:
    """What a pass over a flight says of some of its tones.

    Attributes:
        tones: one column each.
        sums: of the pass; these columns are behind the model's own.
    """

    tones: Sequence[Tone]
    sums: NormalSums

    @classmethod
    def of(cls, made: Examination, tones: Sequence[Tone]) -> Beside:
        """By a pass over the flight of an examination, noise and timing as they are."""
        return cls(tones, made.accompanied(Tones(tones), with_parts(made.batches, tones)))


def heard(batches: Sequence[Batch]) -> list[Tone]:
    """Tones that may be asked about: not what not even the best receiver could tell.

    In the order of their kinds, of each those first that the velocity has most of if they are real.
    """
    fixes, count = sum(len(batch.fixes) for batch in batches), stretches_of(batches)
    told = CLEARLY * LIMITS["velocity"][0] ** 2
    asked = [tone for tone in tones_of(batches) if fixes * _mean(tone, count) > told]
    return sorted(asked, key=lambda tone: (tone.kind, -_mean(tone, count)))


def unseen(full: Examination, tones: Sequence[Tone], beside: Beside | None) -> list[Tone]:
    """Tones without which velocities are likelier, one after the other.

    Nothing is asked of what is more than is left of the velocity: that one has been seen.

    Args:
        full: the flight with every effect.
        tones: that are :func:`heard` in it.
        beside: what the pass over it says of the first of them; None: nothing is known yet.
    """
    left, count = LEFT_OF_TONE * _left(full), stretches_of(full.batches)
    asked = [tone for tone in tones if _mean(tone, count) < left][:MOST_TONES]
    if not asked:
        return []
    if beside is None or any(tone not in beside.tones for tone in asked):
        made = Examination(full, full.families, t0=full.point.skew_from, start=full, traced=False)
        beside = Beside.of(made, asked)
    columns = [full.model.size + beside.tones.index(tone) for tone in asked]
    return [asked[i] for i in _likelier_without(full.model, beside.sums, columns)]


def _likelier_without(model: Model, sums: NormalSums, own: Sequence[int]) -> list[int]:
    """Which of some tones velocities are clearly likelier without, each beside those before it.

    By a column for each, beside every effect, noise as it was found: of a tone that is nothing
    beside a drift, only what is left tells.

    Args:
        model: every effect.
        sums: of a pass with columns of tones behind the model's own.
        own: places of those that are asked about.
    """
    rest, own = list(range(model.size)), list(own)
    information = 1.0 / model.prior_sigma**2
    # Everything else is fitted anew beside whatever is taken off.
    gone = np.linalg.solve(sums.N[np.ix_(rest, rest)] + np.diag(information), sums.N[rest][:, own])
    slope = sums.b[own] - gone.T @ (sums.b[rest] + information * model.prior)
    bend = sums.N[np.ix_(own, own)] - sums.N[own][:, rest] @ gone
    found: list[int] = []
    for i in range(len(own)):
        if 2.0 * slope[i] - bend[i, i] - 2.0 * bend[i, found].sum() > CLEARLY:
            found.append(i)
    return found


def _mean(tone: Tone, count: int) -> float:
    """(m/s)^2 of the velocity over a flight of as many stretches, if it is real."""
    return tone.variance * len(tone.lines) / max(count, 1)


def _left(full: Examination) -> float:
    """(m/s)^2, mean square of what is left of velocities."""
    traces = full.traces
    off = residual(traces.innovation, traces.columns, full.found().theta)
    return float(np.mean(np.nansum(off**2, axis=1))) if len(off) else 0.0
