"""A sensor that repeats one reading: it measures nothing."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import STUCK_S
from onboard.core.maths.arrays import Array, Mask


def stuck(t: Array, x: Array, same: float) -> Mask:
    """(n,) samples of readings that stay the same on all three axes for :data:`STUCK_S`.

    Args:
        t: (n,) s.
        x: (n, 3) force or rates as reported, or any linear function of them.
        same: by so much readings that are the same may differ, in the unit of ``x``
            (:data:`~onboard.core.inputs.limits.SAME_M_S2`,
            :data:`~onboard.core.inputs.limits.SAME_RAD_S`).
    """
    if not len(t):
        return np.zeros(0, dtype=bool)
    moves = np.any(np.abs(np.diff(x, axis=0)) > same, axis=1)
    first = np.flatnonzero(np.concatenate([[True], moves]))
    last = np.append(first[1:], len(t)) - 1
    out: Mask = np.zeros(len(t), dtype=bool)
    for k in np.flatnonzero(t[last] - t[first] >= STUCK_S):
        there = slice(first[k], last[k] + 1)
        out[there] = _at_rest(t[there], x[there], same)
    return out


def _at_rest(t: Array, x: Array, same: float) -> Mask:
    """The samples that stay for long enough where most of them are.

    A low-pass comes there by and by, at a high rate by less than ``same`` from sample to sample;
    and what only creeps moves, too.
    """
    near = np.all(np.abs(x - np.median(x, axis=0)) <= same, axis=1)
    edges = np.flatnonzero(np.diff(near, prepend=False, append=False))
    out: Mask = np.zeros(len(t), dtype=bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        out[begin:end] = t[end - 1] - t[begin] >= STUCK_S
    return out
