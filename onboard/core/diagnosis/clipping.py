"""Accelerometers at the rail of their range: stuck samples, or clipping that was counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.effort import TOGETHER_S
from onboard.core.diagnosis.limits import FEWEST_CLIPPED, LEAST_RAIL, LONGEST_STEP_S
from onboard.core.diagnosis.regimes import spans
from onboard.core.diagnosis.score import least
from onboard.core.estimate.limits import OFFSET_FLOOR
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.spans import inside, joined
from onboard.core.physics.effects.saturation import Saturation
from onboard.core.physics.finding import Finding, Quantity


def saturation_effect(batches: Sequence[Batch], t0: float) -> Finding | None:
    """An accelerometer at the rail of its range: stuck samples, or a count of clipped ones.

    Where it is at its rail at all, whatever was counted goes with it: what vibration takes over the
    rail is cut off, and the mean of what is left, which a low-pass reports, is no force.

    Args:
        batches: the flight.
        t0: first sample, s.
    """
    if not batches:
        return None
    counted = _counted(batches)
    return _stuck(batches, t0, counted.spans) or _often(batches, t0, counted)


def cut_off(batches: Sequence[Batch], t0: float) -> tuple[tuple[float, float], ...]:
    """When clipping may have changed the force by more than any number claims, s since ``t0``.

    A sample that is cut off reads too little by what vibration took over the rail, which is about
    its level; of the mean it is one of so many.
    """
    counted = _counted(batches)
    share = counted.rise * LONGEST_STEP_S / np.diff(counted.spans, axis=1)[:, 0]
    much = counted.spans[share * _level(batches, counted.spans[:, 1]) > OFFSET_FLOOR]
    stuck = _stuck(batches, t0, much)
    if stuck is not None:
        return stuck.intervals
    return tuple((a - t0, b - t0) for a, b in joined(((a, b) for a, b in much.tolist()), 1e-3))


def _level(batches: Sequence[Batch], t: Array) -> Array:
    """Level of vibration (n,) at times, of the axis that shakes most, m/s^2; infinite if untold."""
    told = [c.segment.slow["vibration"] for c in batches if "vibration" in c.segment.slow]
    if not told:
        return np.full(len(t), np.inf)
    at, first = np.unique(np.concatenate([x[0] for x in told]), return_index=True)
    level: Array = np.concatenate([x[1] for x in told])[first].max(axis=1)
    return np.interp(t, at, level)


@dataclass(frozen=True, slots=True)
class _Counted:
    """Times between two reports of clipping in which it was counted, (k, 2) s, and how often."""

    spans: Array
    rise: Array


def _counted(batches: Sequence[Batch]) -> _Counted:
    told = [c.segment.slow["clipping"] for c in batches if "clipping" in c.segment.slow]
    if not told:
        return _Counted(np.zeros((0, 2)), np.zeros(0))
    t, first = np.unique(np.concatenate([x[0] for x in told]), return_index=True)
    rise = np.diff(np.concatenate([x[1] for x in told])[first])
    hit = np.flatnonzero(rise > 0)
    return _Counted(np.stack([t[hit], t[hit + 1]], axis=-1), rise[hit])


def _often(batches: Sequence[Batch], t0: float, counted: _Counted) -> Finding | None:
    """Clipping that the autopilot has counted; a low-pass hides the rail from the samples."""
    if np.count_nonzero(counted.rise >= FEWEST_CLIPPED) < 2:
        return None
    found = joined(((a, b) for a, b in counted.spans.tolist()), 1e-3)
    raw = np.concatenate([c.segment.raw_s for c in batches])
    clipped = inside(np.concatenate([c.segment.t for c in batches]), found)
    if not clipped.any():
        return None
    tops = np.percentile(np.abs(raw[clipped]), 99.9, axis=0)
    worst = int(np.argmax(tops))
    top = float(tops[worst])
    return _saturation(batches, t0, top, 0.03 * top, worst, found, float(clipped.mean()))


def _stuck(batches: Sequence[Batch], t0: float, counted: Array) -> Finding | None:
    """Accelerometer samples that stay at one extreme value: the rail of its range.

    Even a reading that is the one before every other time stays at its extreme so often with the
    probability of so many heads in a row.

    Args:
        batches: the flight.
        t0: first sample, s.
        counted: (k, 2) s; when else it was clipped.
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
    at_all = np.concatenate([np.stack([where, where], axis=-1), counted])
    found = joined(((a, b) for a, b in at_all.tolist()), TOGETHER_S)
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
