"""Readings that repeat: a sensor that says the same for seconds has died, or its driver has."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.vehicle.limits import LONGEST_SPAN_S
from onboard.core.vehicle.signals import Stream

CHANCE: Final = 1e-3
"""Probability of one such run in a recording whose sensor is alive [probability]."""

Spans = tuple[tuple[float, float], ...]


def measured(stream: Stream) -> tuple[Stream, Spans]:
    """A stream without the readings of a sensor that has died, and the spans of those, s.

    A run of one reading is no measurement where it lasts longer than a silence may, and is longer
    than chance makes it: numbers that are rounded, or told more often than they are measured,
    repeat, and how often the rest of the stream does so says for how long at a time.
    """
    if len(stream) < 2:
        return stream, ()
    fresh = np.any(stream.x[1:] != stream.x[:-1], axis=1)
    starts = np.concatenate([[0], np.flatnonzero(fresh) + 1])
    ends = np.concatenate([starts[1:], [len(stream)]]) - 1
    long = stream.t[ends] - stream.t[starts] > LONGEST_SPAN_S
    if not long.any():
        return stream, ()
    repeats = ends - starts
    # Of all readings but those of the run, to repeat the one before: Laplace's rule of succession.
    again = (np.sum(repeats) - repeats + 1.0) / (len(stream) - repeats + 1.0)
    by_chance = math.log(CHANCE / len(stream)) / np.log(again)
    dead = long & (repeats > by_chance)
    keep = np.ones(len(stream), dtype=bool)
    for i, j in zip(starts[dead], ends[dead], strict=True):
        keep[i + 1 : j + 1] = False
    spans = tuple(
        (float(stream.t[i]), float(stream.t[j]))
        for i, j in zip(starts[dead], ends[dead], strict=True)
    )
    return Stream(stream.t[keep], stream.x[keep]), spans
