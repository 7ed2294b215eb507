"""Many samples at once: what a recording holds between two samples that change how others are taken.

Nearly all of a recording is inertial samples and attitudes, of which each is only put behind the one
before.  What else a sample does, a reader decides on by order: a fix hands flight on, a parameter
changes what forces mean, a state ends a flight.  Between two of these, inertial samples and
attitudes may be taken as columns, stream by stream, and so may what only says how the vehicle was
(:data:`ASIDE`).

A :class:`Block` holds some thousand samples in columns, with the place of each in the order of
arrival; :class:`Stretch` is what lies between two places of it.  Where a block holds anything out of
the ordinary, it comes out as single samples; and whoever is handed a stretch that does not continue
what he has, takes its samples one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.core.inputs.range_checks import attitudes_possible, imu_possible
from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    EkfBias,
    ImuSample,
    ImuSource,
    Outputs,
    Sample,
    Throttle,
    Vibration,
)
from onboard.core.maths.arrays import Array

Places: TypeAlias = NDArray[np.int64]

ASIDE: Final = (AirData, Battery, EkfBias, Outputs, Throttle, Vibration)
"""Samples that are kept, or not even that: the order among them and inertial samples means nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class ImuColumns:
    """Inertial samples (n >= 1) of one accelerometer and one source, see :class:`ImuSample`.

    Attributes:
        imu: number of the accelerometer, from 1.
        places: (n,) in the order of arrival, increasing.
        t: (n,) s.
        rows: (n, 7) rate (rad/s), force (m/s^2), temperature (degrees Celsius, NaN: not known).
        f_step: m/s^2, of all.
        w_step: rad/s, of all.
        source: of all.
    """

    imu: int
    places: Places
    t: Array
    rows: Array
    f_step: float = 0.0
    w_step: float = 0.0
    source: ImuSource = ImuSource.LOG

    @property
    def is_plain(self) -> bool:
        """Whether each could be true and is newer than the one before."""
        return increase(self.t) and imu_possible(self.imu, self.t, self.rows[:, :6])

    def samples(self, first: int, last: int) -> Iterator[tuple[int, Sample]]:
        """Some of them one by one, with their places."""
        rows = self.rows[first:last].tolist()
        times, places = self.t[first:last].tolist(), self.places[first:last].tolist()
        for place, t, (p, q, r, x, y, z, heat) in zip(places, times, rows, strict=True):
            celsius = None if math.isnan(heat) else heat
            f_b, w_b, steps = (x, y, z), (p, q, r), (self.f_step, self.w_step)
            yield place, ImuSample(t, self.imu, f_b, w_b, celsius, *steps, self.source)


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeColumns:
    """Attitudes, see :class:`AttitudeSample`.

    Attributes:
        places: (n,) in the order of arrival, increasing.
        t: (n,) s.
        angles: (n, 3) roll, pitch, yaw, rad.
    """

    places: Places
    t: Array
    angles: Array

    @property
    def is_plain(self) -> bool:
        """Whether each could be true, is newer than the one before, and is not just three zeros."""
        return (
            increase(self.t)
            and attitudes_possible(self.t, self.angles)
            and bool(self.angles.any(axis=1).all())
        )

    def samples(self, first: int, last: int) -> Iterator[tuple[int, Sample]]:
        """Some of them one by one, with their places."""
        angles, times = self.angles[first:last].tolist(), self.t[first:last].tolist()
        places = self.places[first:last].tolist()
        for place, t, (roll, pitch, yaw) in zip(places, times, angles, strict=True):
            yield place, AttitudeSample(t, roll, pitch, yaw)


class ImuRun(NamedTuple):
    """Rows ``first`` to before ``last`` of inertial samples; at least one."""

    columns: ImuColumns
    first: int
    last: int

    @property
    def begins(self) -> float:
        """Time of the first, s."""
        return self.columns.t.item(self.first)

    @property
    def ends(self) -> float:
        """Time of the last, s."""
        return self.columns.t.item(self.last - 1)


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """What a block holds between two places.

    ``start`` and ``stop`` are row numbers: of each inertial stream, of attitudes, of what is aside.
    """

    block: Block
    start: tuple[int, ...]
    stop: tuple[int, ...]

    def __len__(self) -> int:
        return sum(self.stop) - sum(self.start)

    @property
    def imus(self) -> list[ImuRun]:
        """Of each accelerometer that has samples here, those."""
        streams = zip(self.block.imus, self.start, self.stop, strict=False)
        return [ImuRun(columns, a, b) for columns, a, b in streams if a < b]

    @property
    def attitude(self) -> tuple[AttitudeColumns, int, int]:
        """Columns, and the first and the end of the rows that are here; maybe none."""
        return self.block.attitude, self.start[-2], self.stop[-2]

    @property
    def aside(self) -> Sequence[Sample]:
        """What only says how the vehicle was."""
        return self.block.aside[self.start[-1] : self.stop[-1]]

    @property
    def latest(self) -> float:
        """The largest time of a sample, s; -inf if none has one."""
        columns, a, b = self.attitude
        ends = [run.ends for run in self.imus]
        ends += [columns.t.item(b - 1)] if a < b else []
        told = (s.t for s in self.aside if s.t is not None and math.isfinite(s.t))
        return max((*ends, *told), default=-math.inf)

    def samples(self) -> Iterator[Sample]:
        """One by one, in the order of arrival."""
        every: list[tuple[int, Sample]] = []
        for columns, first, last in self.imus:
            every += columns.samples(first, last)
        attitudes, first, last = self.attitude
        every += attitudes.samples(first, last)
        places = self.block.aside_places[self.start[-1] : self.stop[-1]]
        every += zip(places, self.aside, strict=True)
        every.sort(key=_place)
        return (sample for _, sample in every)


Piece: TypeAlias = Sample | Stretch
"""What a recording is handed out in."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Samples in the order of arrival, most of them in columns.

    Attributes:
        imus: in the order in which they come first.
        attitude: maybe none.
        aside: see :data:`ASIDE`; ``aside_places`` in the order of arrival.
        events: all others; ``event_places`` likewise.
    """

    imus: tuple[ImuColumns, ...]
    attitude: AttitudeColumns
    aside: list[Sample]
    aside_places: list[int]
    events: list[Sample]
    event_places: list[int]

    @property
    def is_plain(self) -> bool:
        """Whether the order between streams cannot matter, nor any sample be refused for its own.

        What was before the block is not looked at.
        """
        numbers = {columns.imu for columns in self.imus}
        return (
            len(numbers) == len(self.imus)  # of two sources of one accelerometer one is preferred
            and all(columns.is_plain for columns in self.imus)
            and self.attitude.is_plain
            and not self._goes_back()
        )

    def pieces(self) -> Iterator[Piece]:
        """Stretches and, between them, what they must not reach over."""
        if not self.is_plain:
            yield from self.samples()
            return
        places = [columns.places for columns in (*self.imus, self.attitude)]
        places.append(np.array(self.aside_places, np.int64))
        cuts = np.array(self.event_places, np.int64)
        ends = [np.searchsorted(rows, cuts).tolist() for rows in places]
        start = (0,) * len(places)
        for event, stop in zip(self.events, zip(*ends, strict=True), strict=True):
            if stop != start:
                yield Stretch(self, start, stop)
                start = stop
            yield event
        stop = tuple(map(len, places))
        if stop != start:
            yield Stretch(self, start, stop)

    def samples(self) -> Iterator[Sample]:
        """One by one, in the order of arrival."""
        every: list[tuple[int, Sample]] = []
        for columns in (*self.imus, self.attitude):
            every += columns.samples(0, len(columns.t))
        every += zip(self.aside_places, self.aside, strict=True)
        every += zip(self.event_places, self.events, strict=True)
        every.sort(key=_place)
        return (sample for _, sample in every)

    def _goes_back(self) -> bool:
        """Whether an inertial time lies so far behind another that a reboot may be the cause."""
        if not self.imus:
            return False
        order = np.argsort(np.concatenate([columns.places for columns in self.imus]))
        t = np.concatenate([columns.t for columns in self.imus])[order]
        return bool(np.any(t[1:] < np.maximum.accumulate(t)[:-1] - LONGEST_DELAY_S))


def increase(t: Array) -> bool:
    """Whether times (n,) increase; not if one of several is no number."""
    return bool(np.all(t[1:] > t[:-1]))


def _place(placed: tuple[int, Sample]) -> int:
    return placed[0]
