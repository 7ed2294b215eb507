"""Where in a flight a residual lives: intervals, body axes, regimes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.earth import STANDARD_GRAVITY
from onboard.core.engine import Chunk
from onboard.core.findings import RegimeResidual, Where
from onboard.core.passes import EpochTrace, Portion

Array = NDArray[np.float64]

MOST_PLACES = 5
REGIMES = ("turning", "accelerating", "high load factor", "climbing", "high throttle", "steady")


def regime_of(chunk: Chunk) -> str:
    """The word for what a chunk of flight mostly was."""
    s = chunk.stretch
    turn = float(np.sqrt(np.mean(s.w_b[:, 2] ** 2)))
    load = float(np.percentile(-s.raw_s[:, 2], 90)) / STANDARD_GRAVITY
    speed = np.linalg.norm(np.nan_to_num(chunk.fixes.v_n[:, :2]), axis=1)
    surge = float(np.std(speed))
    climb = float(np.ptp(chunk.fixes.height)) / max(chunk.duration, 1e-3)
    if load > 1.3:
        return "high load factor"
    if turn > 0.15:
        return "turning"
    if surge > 1.5:
        return "accelerating"
    if climb > 1.5:
        return "climbing"
    return "steady"


def located(
    portions: Sequence[Portion], chunks: Sequence[Chunk], before: Array, after: Array, t0: float
) -> tuple[Where, ...]:
    """Portions in which the misfit falls most from ``before`` to ``after``, neighbours joined."""
    if len(portions) != len(chunks):
        return ()
    gain = np.array([p.sums.residual(before) - p.sums.residual(after) for p in portions])
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
                portions[g[0]].start - t0,
                portions[g[-1]].end - t0,
                _axis(chunks[inside], before, after),
                regime_of(chunks[inside]),
                float(positive[g].sum() / whole),
            )
        )
    out.sort(key=lambda w: -w.share)
    return tuple(out[:MOST_PLACES])


def _axis(chunk: Chunk, before: Array, after: Array) -> str:
    """Body axis whose six differ most in effect, by the specific force of the chunk."""
    f = np.sqrt(np.mean(chunk.stretch.raw_s**2, axis=0))
    change = np.abs(after[:3] - before[:3]) * f + np.abs(after[3:6] - before[3:6])
    return "body_" + "xyz"[int(np.argmax(change))]


def regime_residuals(
    traces: Sequence[EpochTrace], chunks: Sequence[Chunk], before: Array, after: Array
) -> tuple[RegimeResidual, ...]:
    """Whitened residual by regime, before and after."""
    edges = [(float(c.fixes.t[0]) - 0.5, float(c.fixes.t[-1]) + 0.5, regime_of(c)) for c in chunks]
    squares: dict[str, list[float]] = {}
    for x in traces:
        regime = next((r for a, b, r in edges if a <= x.t <= b), None)
        if regime is None or len(x.y) == 0:
            continue
        one, two = x.y - x.h @ before, x.y - x.h @ after
        s = squares.setdefault(regime, [0.0, 0.0, 0.0])
        s[0] += float(one @ one)
        s[1] += float(two @ two)
        s[2] += len(one)
    seconds = {r: sum(c.duration for c in chunks if regime_of(c) == r) for r in squares}
    return tuple(
        RegimeResidual(r, seconds[r], float(np.sqrt(s[0] / s[2])), float(np.sqrt(s[1] / s[2])))
        for r, s in sorted(squares.items())
    )
