"""Spans of time: those that go on from each other, and what lies in them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from onboard.core.maths.arrays import Array, Mask


def following(spans: Sequence[tuple[float, float]], gap: float = 0.0) -> list[list[int]]:
    """Places of spans (s) that go on from each other, within a gap (s); each list in order."""
    out: list[list[int]] = []
    end = -math.inf
    for k in sorted(range(len(spans)), key=spans.__getitem__):
        start, last = spans[k]
        if not out or start - end > gap:
            out.append([])
        out[-1].append(k)
        end = max(end, last) if len(out[-1]) > 1 else last
    return out


def joined(spans: Iterable[tuple[float, float]], gap: float = 0.0) -> list[tuple[float, float]]:
    """The same in order, those that go on from each other as one."""
    every = list(spans)
    runs = ([every[k] for k in run] for run in following(every, gap))
    return [(run[0][0], max(end for _, end in run)) for run in runs]


def inside(t: Array, spans: list[tuple[float, float]]) -> Mask:
    """(n,) whether times lie in one of the spans."""
    out = np.zeros(len(t), dtype=bool)
    for start, end in spans:
        out |= (t >= start) & (t <= end)
    return out
