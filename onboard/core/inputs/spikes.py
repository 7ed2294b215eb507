"""Single samples that are far from those before and after them.

A bus that loses a bit, or a driver that reads a register too early, gives one sample that has
nothing to do with the vehicle.  Taken for force it makes the prediction jump, and whatever smooths
the prediction is then believed: a receiver that averages, an antenna that swings, an accelerometer
that lags.  A sample is suspected where it is further beyond its neighbours than a Gaussian of the
spread around it ever is.  A knock looks the same; whether the vehicle has felt it, the
receiver's velocity says (:mod:`onboard.core.diagnosis.cleared`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from onboard.core.inputs.joined import with_samples
from onboard.core.inputs.limits import (
    LEAST_SPREAD_M_S2,
    NEAR_SAMPLES,
    NEVER_SIGMAS,
    SPREAD_SAMPLES,
)
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import NORMAL_MEDIAN

AT_ONCE = 4096
"""Samples whose neighbours are looked at at once: two megabytes [cost]."""


@dataclass(frozen=True, slots=True)
class Spikes:
    """Samples that are suspected, and the flight without them.

    Attributes:
        t: (s,) s on the boot clock, in order.
        size: (s,) m/s^2, of the axis on which it is furthest off.
        samples: how many samples the flight has.
        walk: what they would make the velocity walk by if they were false, m/s/sqrt(s).
        batches: the flight, with what is between their neighbours in their place.
    """

    t: Array
    size: Array
    samples: int
    walk: float
    batches: list[Batch]


def spikes_of(batches: Sequence[Batch]) -> Spikes | None:
    """Single samples far from their neighbours; None if there are none."""
    times: list[Array] = []
    sizes: list[Array] = []
    count, lasting = 0, 0.0

    def between(t: Array, raw: Array) -> Array:
        nonlocal count, lasting
        count, lasting = count + len(t), lasting + float(t[-1] - t[0])
        beside = _beside(raw)
        neighbours = beside.mean(axis=0)
        off = raw - np.clip(raw, beside[0], beside[1])
        suspected = np.abs(off) > NEVER_SIGMAS * _spread(raw - neighbours)
        hit = np.flatnonzero(suspected.any(axis=1))
        times.append(t[hit])
        sizes.append(np.max(np.abs(off[hit]), axis=1, initial=0.0))
        return np.where(suspected, neighbours, raw)

    made = with_samples(batches, between)
    t = np.concatenate(times) if times else np.zeros(0)
    if not len(t):
        return None
    size = np.concatenate(sizes)
    # Each is a step of the velocity, of its size times the time that a sample stands for.
    walk = math.sqrt(lasting * float(size @ size)) / count
    return Spikes(t, size, count, walk, made)


def _beside(raw: Array) -> Array:
    """(2, n, 3) the middle two of the four samples next to each.

    What is between them may be a step; one of the four may be false, too.
    """
    if len(raw) < 5:
        return np.stack([raw, raw])
    padded = np.pad(raw, ((2, 2), (0, 0)), mode="reflect", reflect_type="odd")
    out = np.empty((2, *raw.shape))
    for i in range(0, len(raw), AT_ONCE):
        part = padded[i : i + AT_ONCE + 4]
        four = np.stack([part[k : k + len(part) - 4] for k in (0, 1, 3, 4)])
        four.sort(axis=0)
        out[:, i : i + AT_ONCE] = four[1:3]
    return out


def _spread(off: Array) -> Array:
    """(n, 3) sigma of distances (n, 3): the largest of before, after and around each.

    By medians, which few false ones do not move; before and after, as vibration comes at once.
    """
    size, out = np.abs(off), np.empty_like(off)
    for part in np.array_split(np.arange(len(off)), max(len(off) // SPREAD_SAMPLES, 1)):
        out[part] = np.median(size[part], axis=0)
    if len(off) > 2 * NEAR_SAMPLES:
        windows = sliding_window_view(size, NEAR_SAMPLES, axis=0)
        # A median copies what it is of: of all at once, half a kilobyte a sample.
        parts = (windows[i : i + AT_ONCE] for i in range(0, len(windows), AT_ONCE))
        near = np.concatenate([np.median(part, axis=-1) for part in parts])
        inner = slice(NEAR_SAMPLES, -NEAR_SAMPLES)
        before, after = near[: -NEAR_SAMPLES - 1], near[NEAR_SAMPLES + 1 :]
        out[inner] = np.maximum.reduce([out[inner], before, after])
    return np.maximum(out / NORMAL_MEDIAN, LEAST_SPREAD_M_S2)
