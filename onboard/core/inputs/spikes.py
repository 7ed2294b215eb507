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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

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

AT_ONCE = 4000
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
        now = raw
        for edges in _parts(len(raw)):
            part = slice(edges[0], edges[-1])
            neighbours, off, spread = _looked_at(raw, edges)
            suspected = np.abs(off) > NEVER_SIGMAS * spread
            hit = np.flatnonzero(suspected.any(axis=1))
            if not len(hit):
                continue
            if now is raw:
                now = raw.copy()
            now[part][suspected] = neighbours[suspected]
            times.append(t[part][hit])
            sizes.append(np.abs(off[hit]).max(axis=1))
        return now

    made = with_samples(batches, between)
    t = np.concatenate(times) if times else np.zeros(0)
    if not len(t):
        return None
    size = np.concatenate(sizes)
    # Each is a step of the velocity, of its size times the time that a sample stands for.
    walk = math.sqrt(lasting * float(size @ size)) / count
    return Spikes(t, size, count, walk, made)


def _parts(n: int) -> Iterator[list[int]]:
    """Where the stretches of ``n`` samples begin over which the spread is measured, and end.

    Some stretches at once: a diagnosis beside an autopilot has no room for all of a flight.
    """
    count = max(n // SPREAD_SAMPLES, 1)
    length, longer = divmod(n, count)
    edges = [i * length + min(i, longer) for i in range(count + 1)]
    at_once = AT_ONCE // SPREAD_SAMPLES
    for i in range(0, count, at_once):
        yield edges[i : i + at_once + 1]


def _looked_at(raw: Array, edges: Sequence[int]) -> tuple[Array, Array, Array]:
    """Samples ``edges[0]`` to ``edges[-1]`` of all (n, 3), with some before and after them.

    Returns:
        Three arrays (k, 3): the mean of the neighbours, how far a sample is beyond them, and the
        sigma of its distance from their mean: the largest of before, after and around it.  By
        medians, which few false ones do not move; before and after, as vibration comes at once.
    """
    first, end = edges[0], edges[-1]
    low, high = max(first - NEAR_SAMPLES, 0), min(end + NEAR_SAMPLES, len(raw))
    beside = _beside(raw, low, high)
    neighbours = beside.mean(axis=0)
    size = np.abs(raw[low:high] - neighbours)
    spread = np.empty((end - first, 3))
    for one, other in pairwise(edges):
        spread[one - first : other - first] = np.median(size[one - low : other - low], axis=0)
    # Those without so many on either side are measured by what is around them alone.
    inner = slice(max(first, NEAR_SAMPLES), min(end, len(raw) - NEAR_SAMPLES))
    if inner.start < inner.stop:
        near = np.median(sliding_window_view(size, NEAR_SAMPLES, axis=0), axis=-1)
        count, before = inner.stop - inner.start, inner.start - NEAR_SAMPLES - low
        after = before + NEAR_SAMPLES + 1
        its = spread[inner.start - first : inner.stop - first]
        np.maximum.reduce(
            [its, near[before : before + count], near[after : after + count]], out=its
        )
    own = slice(first - low, end - low)
    off = raw[first:end] - np.clip(raw[first:end], beside[0, own], beside[1, own])
    return neighbours[own], off, np.maximum(spread / NORMAL_MEDIAN, LEAST_SPREAD_M_S2)


def _beside(raw: Array, low: int, high: int) -> Array:
    """(2, high - low, 3) the middle two of the four samples next to each of ``low`` to ``high``.

    What is between them may be a step; one of the four may be false, too.
    """
    if len(raw) < 5:
        return np.stack([raw[low:high], raw[low:high]])
    a, b = max(low - 2, 0), min(high + 2, len(raw))
    missing = (2 - low + a, 2 - b + high)
    part = np.pad(raw[a:b], (missing, (0, 0)), mode="reflect", reflect_type="odd")
    four = np.stack([part[k : k + high - low] for k in (0, 1, 3, 4)])
    four.sort(axis=0)
    return four[1:3]
