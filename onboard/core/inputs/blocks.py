"""Many samples of a recording at once: inertial ones and attitudes as columns, others as they are.

Nearly all of a recording is inertial samples and attitudes, of which each is only put behind the
one before.  What else is done depends on where the other samples stand among them: a fix hands
flight on, a parameter changes what forces mean, a state ends a flight.  A :class:`Block` keeps
that order by places, so that whoever takes it finds the same as if it were fed one by one; if
anything in it is out of the ordinary (late, repeated, of another boot, impossible), it is to be
fed one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.boot_time import FARTHEST_S, LONGEST_DELAY_S
from onboard.core.inputs.limits import HIGHRES_S
from onboard.core.inputs.range_checks import attitudes_possible, imu_possible
from onboard.core.inputs.samples import (
    COARSE,
    AttitudeSample,
    GpsFix,
    ImuSample,
    ImuSource,
    ParameterValue,
    Sample,
)
from onboard.core.maths.arrays import Array

Places: TypeAlias = NDArray[np.int64]
"""(n,) increasing: where samples stand among all of a block, in the order of arrival."""
Placed: TypeAlias = tuple[int, Sample]


@dataclass(frozen=True, slots=True, eq=False)
class ImuColumns:
    """Inertial samples of one accelerometer and one source, at least one, as in :class:`ImuSample`.

    Attributes:
        imu: number of the accelerometer, from 1.
        places: (n,)
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
        return _increase(self.t) and imu_possible(self.imu, self.t, self.rows[:, :6])

    def samples(self) -> Iterator[Placed]:
        """One by one, with their places."""
        f_step, w_step, source = self.f_step, self.w_step, self.source
        for place, t, row in zip(
            self.places.tolist(), self.t.tolist(), self.rows.tolist(), strict=True
        ):
            p, q, r, x, y, z, heat = row
            celsius = None if math.isnan(heat) else heat
            f_b, w_b = (x, y, z), (p, q, r)
            yield place, ImuSample(t, self.imu, f_b, w_b, celsius, f_step, w_step, source)


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeColumns:
    """Attitudes, maybe none, as in :class:`AttitudeSample`.

    Attributes:
        places: (n,)
        t: (n,) s.
        angles: (n, 3) roll, pitch, yaw, rad.
    """

    places: Places
    t: Array
    angles: Array

    @property
    def is_plain(self) -> bool:
        """Whether each could be true, is newer than the one before, and not just three zeros."""
        return (
            _increase(self.t)
            and attitudes_possible(self.t, self.angles)
            and bool(self.angles.any(axis=1).all())
        )

    def samples(self) -> Iterator[Placed]:
        """One by one, with their places."""
        rows = zip(self.places.tolist(), self.t.tolist(), self.angles.tolist(), strict=True)
        for place, t, (roll, pitch, yaw) in rows:
            yield place, AttitudeSample(t, roll, pitch, yaw)


NO_ATTITUDE = AttitudeColumns(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 3)))


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Samples that came one after the other.

    Attributes:
        imus: inertial samples, in the order in which their first ones came.
        attitude: attitudes.
        others: what is neither, in the order of arrival.
        places: (n,) of the others, not decreasing.
    """

    imus: tuple[ImuColumns, ...]
    attitude: AttitudeColumns
    others: list[Sample]
    places: list[int]
    kept: tuple[ImuColumns, ...] = field(init=False, repr=False)
    """Inertial samples without coarse ones where the finer HIGHRES_IMU is beside them."""
    coarse: tuple[tuple[ImuColumns, ImuColumns], ...] = field(init=False, repr=False)
    """Each of those, and the finer ones."""
    _imu_places: Places = field(init=False, repr=False)
    _imu_t: Array = field(init=False, repr=False)
    """Inertial samples of all accelerometers in the order of arrival."""

    def __post_init__(self) -> None:
        places = np.concatenate([np.zeros(0, np.int64), *(c.places for c in self.imus)])
        t = np.concatenate([np.zeros(0), *(c.t for c in self.imus)])
        order = np.argsort(places)
        fine = {c.imu: c for c in self.imus if c.source is ImuSource.HIGHRES_IMU}
        raw = [c for c in self.imus if c.source in COARSE and c.imu in fine]
        object.__setattr__(self, "kept", tuple(c for c in self.imus if c not in raw))
        object.__setattr__(self, "coarse", tuple((c, fine[c.imu]) for c in raw))
        object.__setattr__(self, "_imu_places", places[order])
        object.__setattr__(self, "_imu_t", t[order])

    def __len__(self) -> int:
        return len(self._imu_t) + len(self.attitude.t) + len(self.others)

    @property
    def is_plain(self) -> bool:
        """Whether nothing is to be refused, or to begin a boot, for what is in the block itself."""
        numbers = {columns.imu for columns in self.kept}
        step = self._imu_t[1:] - self._newest(-math.inf)[1:-1]
        return (
            len(numbers) == len(self.kept)  # two sources of one accelerometer refuse each other's
            and all(columns.is_plain for columns in self.imus)
            and all(_covers(fine, raw) for raw, fine in self.coarse)
            and self.attitude.is_plain
            and not np.any((step < -LONGEST_DELAY_S) | (step > FARTHEST_S))
        )

    @property
    def receivers(self) -> frozenset[int]:
        """Receivers whose fixes are in it."""
        return frozenset(s.receiver for s in self.others if isinstance(s, GpsFix))

    @property
    def parameters(self) -> frozenset[str]:
        """Names of parameters that are reported in it."""
        return frozenset(s.name for s in self.others if isinstance(s, ParameterValue))

    @property
    def first_imu(self) -> float:
        """The least time of an inertial sample, if the block is plain, s; inf if there is none."""
        return min((columns.t.item(0) for columns in self.imus), default=math.inf)

    @property
    def leads(self) -> float:
        """Time of the inertial sample that came first, s; -inf if there is none."""
        return self._imu_t.item(0) if len(self._imu_t) else -math.inf

    @property
    def latest(self) -> float:
        """The largest time of all, s; -inf if there is none."""
        columns = (self._imu_t, self.attitude.t)
        ends = [float(t[np.isfinite(t)].max()) for t in columns if np.isfinite(t).any()]
        told = (s.t for s in self.others if s.t is not None and math.isfinite(s.t))
        return max((*ends, *told), default=-math.inf)

    def heard(self) -> list[float]:
        """(n + 1,) s: the latest inertial time since the one of the others before, -inf if none.

        The last one is that of what comes after the others.
        """
        out = np.full(len(self.others) + 1, -np.inf)
        before = np.searchsorted(np.array(self.places, np.int64), self._imu_places)
        np.maximum.at(out, before, self._imu_t)
        heard: list[float] = out.tolist()
        return heard

    def attitude_ahead(self, newest: float) -> float:
        """By how much an attitude is ahead of the inertial samples before it at the most, s.

        Args:
            newest: the latest inertial time before the block, s.
        """
        before = np.searchsorted(self._imu_places, self.attitude.places)
        ahead = self.attitude.t - self._newest(newest)[before]
        return float(ahead.max(initial=-np.inf))

    def samples(self) -> Iterator[Sample]:
        """One by one, in the order of arrival."""
        every: list[Placed] = list(zip(self.places, self.others, strict=True))
        for columns in self.imus:
            every += columns.samples()
        every += self.attitude.samples()
        every.sort(key=_place)
        return (sample for _, sample in every)

    def _newest(self, before: float) -> Array:
        """(n + 1,) the latest inertial time before each inertial sample, and after the last."""
        newest: Array = np.maximum.accumulate(np.append(before, self._imu_t))
        return newest


Piece: TypeAlias = Sample | Block
"""What a recording is handed out in."""


def _increase(t: Array) -> bool:
    """Whether times (n,) increase; not if one of several is no number."""
    return bool(np.all(t[1:] > t[:-1]))


def _covers(fine: ImuColumns, raw: ImuColumns) -> bool:
    """Whether each of the coarser samples, from the first of the finer on, follows one closely."""
    before = np.searchsorted(fine.places, raw.places) - 1
    its = before >= 0
    return bool(np.all(raw.t[its] - fine.t[before[its]] < HIGHRES_S))


def _place(placed: Placed) -> int:
    return placed[0]
