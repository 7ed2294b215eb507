"""Where in a flight a residual lives: intervals, body axes, regimes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.diagnosis.epochs import Epochs
from onboard.core.diagnosis.records import RegimeResidual
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.physics.finding import Where

MOST_PLACES = 5


def regime_of(batch: Batch) -> str:
    """The word for what a batch of flight mostly was."""
    s = batch.segment
    turn = float(np.sqrt(np.mean(s.w_b[:, 2] ** 2)))
    load = float(np.percentile(-(s.raw_s @ s.R_bs.T)[:, 2], 90)) / STANDARD_GRAVITY
    speed = np.linalg.norm(np.nan_to_num(batch.fixes.v_n[:, :2]), axis=1)
    surge = float(np.std(speed))
    climb = float(np.ptp(batch.fixes.height)) / max(batch.duration, 1e-3)
    if load > 1.3:
        return "high load factor"
    if turn > 0.15:
        return "turning"
    if surge > 1.5:
        return "accelerating"
    if climb > 1.5:
        return "climbing"
    return "steady"


@dataclass(frozen=True, slots=True)
class Residuals:
    """Velocity residuals of a flight by epoch: ``t`` (n,) s, the rest (n, 3) NED, m/s."""

    t: Array
    before: Array
    after: Array


def located(
    blocks: Sequence[Block],
    batches: Sequence[Batch],
    before: Array,
    after: Array,
    t0: float,
    axes: Mapping[int, str],
    residuals: Residuals,
) -> tuple[Where, ...]:
    """Blocks in which the misfit falls most from ``before`` to ``after``, neighbours joined.

    Args:
        blocks: sums of the flight.
        batches: the flight, one for each block.
        before: (m,) unknowns without what was found.
        after: (m,) with it.
        t0: first sample, s.
        axes: body axis on which each of the columns in question acts; others act on none.
        residuals: what these two leave of the velocity.
    """
    if len(blocks) != len(batches):
        return ()
    every = (p.sums for p in blocks)
    gain = np.array([sums.residual(before) - sums.residual(after) for sums in every])
    positive = np.clip(gain, 0.0, None)
    whole = float(positive.sum())
    if whole <= 0.0:
        return ()
    order = np.argsort(-positive)
    keep = sorted(int(i) for i in order[: 2 * MOST_PLACES] if positive[i] > 0.05 * whole)
    groups: list[list[int]] = []
    for i in keep:
        if groups and i == groups[-1][-1] + 1:
            groups[-1].append(i)
        else:
            groups.append([i])
    out = []
    for g in groups:
        inside = g[int(np.argmax(positive[g]))]
        out.append(
            Where(
                blocks[g[0]].start - t0,
                blocks[g[-1]].end - t0,
                _axis(blocks[inside], after - before, axes)
                or _earth_axis(blocks[inside], residuals),
                regime_of(batches[inside]),
                float(positive[g].sum() / whole),
            )
        )
    out.sort(key=lambda w: -w.share)
    return tuple(out[:MOST_PLACES])


def spans(
    batches: Sequence[Batch], t0: float, intervals: Sequence[tuple[float, float]], axis: str
) -> tuple[Where, ...]:
    """Places of something whose times are known (s since the first sample), longest first."""
    whole = sum(b - a for a, b in intervals)
    out = []
    for a, b in intervals:
        middle = t0 + 0.5 * (a + b)
        batch = min(batches, key=lambda c: abs(0.5 * (c.fixes.t[0] + c.fixes.t[-1]) - middle))
        out.append(Where(a, b, axis, regime_of(batch), (b - a) / whole if whole else 1.0))
    out.sort(key=lambda w: -w.share)
    return tuple(out[:MOST_PLACES])


def main_axis(sizes: Array) -> str:
    """Body axis of the largest of three."""
    return "body_" + "xyz"[int(np.argmax(np.abs(sizes)))]


def _axis(block: Block, change: Array, axes: Mapping[int, str]) -> str:
    """Body axis along which the columns in question moved most; empty if they have none."""
    moved, N = dict.fromkeys(axes.values(), 0.0), block.sums.N
    for i, axis in axes.items():
        moved[axis] += float(change[i] ** 2 * N[i, i])
    return max(moved, key=lambda a: moved[a]) if any(moved.values()) else ""


def _earth_axis(block: Block, residuals: Residuals) -> str:
    """Earth axis on which the velocity residual fell most."""
    here = (residuals.t >= block.start - 1e-6) & (residuals.t <= block.end + 1e-6)
    if not here.any():
        return "earth_north"
    fall = np.nansum(residuals.before[here] ** 2 - residuals.after[here] ** 2, axis=0)
    return "earth_" + ("north", "east", "down")[int(np.argmax(fall))]


def axis_of(key: str) -> str | None:
    """Body axis on which an unknown of an effect acts; None if on none in particular."""
    if key in ("roll", "pitch"):
        # A tilt about x turns gravity towards y, and one about y towards x.
        return "body_y" if key == "roll" else "body_x"
    return f"body_{key[0]}" if key and set(key) <= set("xyz") else None


def regime_residuals(
    epochs: Epochs, blocks: Sequence[Block], batches: Sequence[Batch], before: Array, after: Array
) -> tuple[RegimeResidual, ...]:
    """Residuals by regime with two sets of unknowns, (m,) each.

    Args:
        epochs: velocities.
        blocks: sums of all that was measured.
        batches: the flight of each block.
        before: without what was found.
        after: with it.
    """
    velocities = [epochs.residual(theta) ** 2 for theta in (before, after)]
    seen = np.isfinite(velocities[0]).sum(axis=1)
    squares: dict[str, Array] = {}
    seconds: dict[str, float] = {}
    of_epoch = [np.nansum(v, axis=1) for v in velocities]
    by_block = [np.bincount(epochs.block, x, len(blocks)) for x in (*of_epoch, seen)]
    for block, batch, one, two, count in zip(blocks, batches, *by_block, strict=True):
        if block.rows == 0:
            continue
        regime, sums = regime_of(batch), block.sums
        s = squares.setdefault(regime, np.zeros(6))
        s += (sums.residual(before), sums.residual(after), sums.rows, one, two, count)
        seconds[regime] = seconds.get(regime, 0.0) + batch.duration
    out = []
    for r, s in sorted(squares.items()):
        whitened = np.sqrt(np.maximum(s[:2], 0.0) / s[2])
        velocity = np.sqrt(s[3:5] / s[5]) if s[5] else np.full(2, np.nan)
        out.append(RegimeResidual(r, seconds[r], *map(float, (*whitened, *velocity))))
    return tuple(out)
