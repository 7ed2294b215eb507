"""What samples miss: how far velocity and attitude may be from what was integrated.

Between two samples a curve is drawn.  Where the force or the rate jumps - ground is touched, a
catapult lets go, something is hit - it happened at some moment between two of them, and nothing
says at which: a jump of ``x`` in a time ``h`` leaves ``x h / sqrt(12)`` of what was integrated
unknown.  How suddenly a signal changes, its samples tell themselves: by how far each is from the
cubic through its four neighbours.  A jump leaves such misses of 1, -3, 3 and -1 sixths of it at the
four samples around it, so the variance of what is missed is ``36 / 240`` of their squares times
``h^2`` each; of what is smooth they are next to nothing (the curve goes through as many samples),
and of white noise its variance is less than a third of what the samples' own random walk has.

Noise is everywhere and is a level of its own (:mod:`onboard.core.filter.noise`); only what is in
the tail of the misses of its own segment counts.  Its sigma is that of three quarters of them: half
of a segment may stand still, and a quarter of it be a flip.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import SUDDEN
from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import NORMAL_THREE_QUARTERS

NEIGHBOURS = (-2, -1, 1, 2)
"""Samples before and after through which the cubic goes: as many as the curve that is integrated
leans on [physics: at 25 Hz a swing of 2 Hz misses it by a hundredth of its size, and a straight
line through two by an eighth]."""
OF_A_JUMP = 36.0 / 240.0
"""Variance of what is missed of a jump over the sum of its squared misses and ``h^2``
[physics: 1 / 12 over (1 + 9 + 9 + 1) / 36]."""


def missed_between(segment: Segment, start: Array, end: Array) -> Array:
    """Variances of what the samples of a segment miss in steps that follow each other.

    Args:
        segment: samples.
        start: (K,) s, in order.
        end: (K,) s, each the start of the next.

    Returns:
        (K, 6) of velocity, (m/s)^2, and of turn, rad^2, both by body axes.
    """
    out = np.zeros((len(start), 6))
    at, axis, var = segment.once(_sudden)
    if not len(at):
        return out
    step = np.searchsorted(end, at)
    inside = (at >= start[0]) & (step < len(end))
    np.add.at(out, (step[inside], axis[inside]), var[inside])
    return out


def _sudden(segment: Segment) -> tuple[Array, NDArray[np.intp], Array]:
    """When samples are no noise but something sudden (s), on which of six axes; variances."""
    t = segment.t
    if len(t) <= len(NEIGHBOURS):
        return np.zeros(0), np.zeros(0, dtype=np.intp), np.zeros(0)
    x = np.concatenate([segment.raw_s @ segment.R_bs.T, segment.w_b], axis=1)
    miss = misses(t, x)
    typical = np.quantile(np.abs(miss), 0.75, axis=0) / NORMAL_THREE_QUARTERS
    where, axis = np.nonzero(np.abs(miss) > SUDDEN * typical)
    h = 0.5 * (t[where + 3] - t[where + 1])
    return t[where + 2], axis, OF_A_JUMP * (h * miss[where, axis]) ** 2


def misses(t: Array, x: Array) -> Array:
    """How far each sample is from the cubic through two before and two after it.

    Args:
        t: (n,) s, n > 4.
        x: (n, k) samples.

    Returns:
        (n - 4, k) of all but the first two and the last two.
    """
    n = len(t) - 4
    at = [t[2 + i : 2 + i + n] for i in NEIGHBOURS]
    now = t[2 : 2 + n]
    out: Array = x[2 : 2 + n].copy()
    for k, i in enumerate(NEIGHBOURS):
        others = [j for j in range(4) if j != k]
        weight = np.ones(n)
        for j in others:
            weight *= (now - at[j]) / (at[k] - at[j])
        out -= weight[:, None] * x[2 + i : 2 + i + n]
    return out
