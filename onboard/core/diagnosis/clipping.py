"""Accelerometers at the rail of their range: stuck samples, or clipping that was counted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.limits import FEWEST_CLIPPED, LEAST_RAIL
from onboard.core.diagnosis.regimes import spans
from onboard.core.diagnosis.score import least
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effects.saturation import Saturation
from onboard.core.physics.finding import Finding, Quantity


def saturation_effect(batches: Sequence[Batch], t0: float) -> Finding | None:
    """An accelerometer at the rail of its range: stuck samples, or a count of clipped ones.

    Args:
        batches: the flight.
        t0: first sample, s.
    """
    if not batches:
        return None
    return _stuck(batches, t0) or _counted(batches, t0)


def _counted(batches: Sequence[Batch], t0: float) -> Finding | None:
    """Clipping that the autopilot has counted; a low-pass hides the rail from the samples."""
    names = [c.segment.slow["clipping"] for c in batches if "clipping" in c.segment.slow]
    if not names:
        return None
    t = np.concatenate([x[0] for x in names])
    counts = np.concatenate([x[1] for x in names])
    t, first = np.unique(t, return_index=True)
    rise = np.diff(counts[first])
    hit = np.flatnonzero(rise >= FEWEST_CLIPPED)
    if len(hit) < 2:
        return None
    spans_of = [(float(t[i]), float(t[i + 1])) for i in hit]
    joined: list[tuple[float, float]] = []
    for begin, end in spans_of:
        if joined and begin - joined[-1][1] < 1e-3:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    raw = np.concatenate([c.segment.raw_s for c in batches])
    times = np.concatenate([c.segment.t for c in batches])
    inside = np.zeros(len(times), dtype=bool)
    for begin, end in joined:
        inside |= (times >= begin) & (times <= end)
    if not inside.any():
        return None
    tops = np.percentile(np.abs(raw[inside]), 99.9, axis=0)
    worst = int(np.argmax(tops))
    top = float(tops[worst])
    return _saturation(batches, t0, top, 0.03 * top, worst, joined, float(inside.mean()))


def _stuck(batches: Sequence[Batch], t0: float) -> Finding | None:
    """Accelerometer samples that stay at one extreme value: the rail of its range.

    Even a reading that is the one before every other time stays at its extreme so often with the
    probability of so many heads in a row.
    """
    best: tuple[int, float, NDArray[np.bool_], int] | None = None
    for j in range(3):
        read = np.concatenate([c.segment.raw_s[:, j] for c in batches])
        for sign in (1.0, -1.0):
            x = sign * read
            top = float(x.max())
            at = x >= top - 1e-9
            begins = int(at[0]) + int(np.count_nonzero(at[1:] & ~at[:-1]))
            stayed = 2.0 * np.log(2.0) * (int(at.sum()) - begins)
            stuck = stayed >= least() and at.mean() < 0.5
            if stuck and top > LEAST_RAIL and (best is None or at.sum() > best[0]):
                best = (int(at.sum()), sign * top, at, j)
    if best is None:
        return None
    t = np.concatenate([c.segment.t for c in batches])
    where = t[best[2]]
    cuts = np.flatnonzero(np.diff(where) > 2.0)
    starts = np.concatenate([[where[0]], where[cuts + 1]])
    ends = np.concatenate([where[cuts], [where[-1]]])
    found = [(float(a), float(b)) for a, b in zip(starts, ends, strict=True)]
    return _saturation(batches, t0, abs(best[1]), 0.01, best[3], found, best[0] / len(t))


def _saturation(
    batches: Sequence[Batch],
    t0: float,
    limit: float,
    sigma: float,
    sensor_axis: int,
    clipped: Sequence[tuple[float, float]],
    share: float,
) -> Finding:
    """The record of a clipping accelerometer; ``clipped`` s on the boot clock."""
    intervals = tuple((a - t0, b - t0) for a, b in clipped)
    axis = "body_" + "xyz"[int(np.argmax(np.abs(batches[0].segment.R_bs[:, sensor_axis])))]
    return Finding(
        name=Saturation.effect,
        unknowns={"limit": Quantity(limit, sigma, "m/s^2")},
        share_of_mismatch=share,
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure=Saturation.cure,
        where=spans(batches, t0, intervals, axis),
        intervals=intervals,
    )
