"""Where samples wait until a batch of flight is complete: one track per stream.

Tracks refuse what is late, repeated or not finite, count it by name, and hand out arrays.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import ImuColumns
from onboard.core.inputs.even_times import even_times
from onboard.core.inputs.limits import (
    BEFORE_NEXT_S,
    GROUND_M,
    HIGHRES_S,
    LONGEST_FIX_GAP_S,
    SILENT_S,
    STILL_M_S,
    TEMPERATURE_EVERY,
)
from onboard.core.inputs.reach import Reach, reach_of
from onboard.core.inputs.rows import Rows
from onboard.core.inputs.samples import COARSE, GpsFix, ImuSample, ImuSource
from onboard.core.inputs.segments import Signal
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array


def untruncated(x: Array, step: float) -> Array:
    """Middles of the intervals that integer truncation toward zero maps to these values.

    ``|x|`` in [k, k + 1) steps is sent as k; zero stands for -1 ... 1 and stays zero.
    """
    out: Array = x + np.sign(x) * (0.5 * step)
    return out


class _Manner(NamedTuple):
    """How samples were made of what was measured: resolutions, parameters and board orientation."""

    w_step: float
    f_step: float
    six: SixParameters
    R_bs: Array | None

    def undone(self, rows: Array) -> Array:
        """Rate, force and temperature (n, 7) with the force raw, and nothing truncated."""
        w, f = untruncated(rows[:, :3], self.w_step), untruncated(rows[:, 3:6], self.f_step)
        if self.R_bs is not None:
            f = f @ self.R_bs
        raw = f / np.array(self.six.scale) + np.array(self.six.offset)
        return np.concatenate((w, raw, rows[:, 6:]), axis=1)


class ImuTrack:
    """Raw inertial samples of one IMU.

    Attributes:
        beside: temperature, degC, that coarser samples have told which were not taken: HIGHRES_IMU
            tells none of the accelerometer.
    """

    __slots__ = ("_arrays", "_manners", "_rows", "beside", "highres_t", "mismatched", "refused")

    def __init__(self) -> None:
        self.beside = SlowTrack()
        self._rows = Rows()
        """Rate, force and temperature as reported."""
        self._manners: list[tuple[int, _Manner]] = []
        """From which row on they were made in which manner: it changes once a flight, if at all."""
        self._arrays: tuple[Array, Array] | None = None
        self.highres_t = -np.inf
        self.mismatched = 0
        self.refused: Counter[str] = Counter()

    @property
    def last(self) -> float:
        """Time of the newest sample; -inf if there is none."""
        return self._rows.last

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, sample: ImuSample, six: SixParameters, R_bs: Array | None) -> bool:
        """Keep the sample, of which truncation and parameters are undone; False if it was refused.

        Args:
            sample: as reported.
            six: parameters in force when it was measured.
            R_bs: board orientation, None for the identity.
        """
        t = sample.t
        if sample.source is ImuSource.HIGHRES_IMU:
            self.highres_t = t
        elif self.covers(t) and sample.source in COARSE:
            if sample.temperature is not None:
                self.beside.add(t, (sample.temperature,))
            return False
        rows = self._rows
        if not t > rows.last:
            self.refused["imu_late" if t < rows.last else "imu_repeated"] += 1
            return False
        if sample.w_b is None:
            self.refused["imu_without_gyro"] += 1
            return False
        row = (*sample.w_b, *sample.f_b)
        if not math.isfinite(sum(row)):
            self.refused["imu_not_finite"] += 1
            return False
        celsius = np.nan if sample.temperature is None else sample.temperature
        self._made(sample.w_step, sample.f_step, six, R_bs)
        rows.add(t, (*row, celsius))
        return True

    def felt(self, since: float) -> float:
        """The largest force that was reported since then (s), m/s^2; 0 if none was."""
        t, rows = self._rows.arrays()
        recent = rows[np.searchsorted(t, since) :, 3:6] if len(t) else np.zeros((0, 3))
        return float(np.sqrt((recent**2).sum(axis=1).max(initial=0.0)))

    def covers(self, t: float) -> bool:
        """Whether HIGHRES_IMU came so shortly before ``t`` (s) that no coarser one is taken."""
        return t - self.highres_t < HIGHRES_S

    def continued_by(self, columns: ImuColumns) -> bool:
        """Whether plain samples are newer than all that are here, and none is to be refused."""
        begins = columns.t.item(0)
        coarse = columns.source in COARSE and self.covers(begins)
        return begins > self._rows.last and not coarse

    def extend(
        self, columns: ImuColumns, rows: slice, six: SixParameters, R_bs: Array | None
    ) -> None:
        """Keep samples (at least one) of columns that continue this, as :meth:`add` would."""
        t = columns.t[rows]
        if columns.source is ImuSource.HIGHRES_IMU:
            self.highres_t = t.item(-1)
        self._made(columns.w_step, columns.f_step, six, R_bs)
        self._rows.extend(t, columns.rows[rows])

    def lay_beside(self, columns: ImuColumns, rows: slice) -> None:
        """Take the temperature of coarser samples that are not taken, as :meth:`add` would."""
        t, celsius = columns.t[rows], columns.rows[rows, 6]
        new = np.isfinite(celsius) & (t > self.beside.last)
        if np.any(new):
            self.beside.extend(t[new], celsius[new, None])

    def warmth(self, t: Array, celsius: Array) -> Signal | None:
        """Times (k,), s, and temperature (k,) during samples at ``t`` (n,); None: nobody told it.

        Args:
            t: s.
            celsius: (n,) what the samples themselves told, NaN where nothing.
        """
        few, known = slice(None, None, TEMPERATURE_EVERY), np.isfinite(celsius)
        if np.all(known):
            return t[few].copy(), celsius[few].copy()
        told, warm = self.beside.around(float(t[0]), float(t[-1]))
        times = np.concatenate([t[known], told])
        order = np.argsort(times, kind="stable")
        # A sensor that warms up through 0 degC tells that once or twice, and it means unknown.
        if not len(times) or max(times.min() - t[0], t[-1] - times.max()) > SILENT_S:
            return None
        return times[order][few], np.concatenate([celsius[known], warm.reshape(-1)])[order][few]

    def _made(self, w_step: float, f_step: float, six: SixParameters, R_bs: Array | None) -> None:
        """Something is added that was made in this manner."""
        self._arrays = None
        manner = self._manners[-1][1] if self._manners else None
        if (
            manner is None
            or (manner.six is not six and manner.six != six)
            or manner.R_bs is not R_bs
            or manner.w_step != w_step
            or manner.f_step != f_step
        ):
            self._manners.append((len(self._rows), _Manner(w_step, f_step, six, R_bs)))

    def arrays(self) -> tuple[Array, Array]:
        """``t`` (n,) and rows (n, 7): rate, raw, temperature; of all who ask the same ones."""
        if self._arrays is None:
            t, rows = self._rows.arrays()
            t, rows = t.copy(), rows.reshape(len(t), 7).copy()
            for k, (first, manner) in enumerate(self._manners):
                last = self._manners[k + 1][0] if k + 1 < len(self._manners) else len(rows)
                rows[first:last] = manner.undone(rows[first:last])
            self._arrays = t, rows
            for array in self._arrays:
                array.flags.writeable = False
        return self._arrays

    def drop_before(self, t: float) -> None:
        """Forget what is older than ``t``."""
        i = int(np.searchsorted(self._rows.arrays()[0], t))
        self._rows.drop(i)
        self.beside.drop_before(t)
        manners = [(max(first - i, 0), manner) for first, manner in self._manners]
        # Of those that begin with the first row that is left, the last is in force there.
        over = sum(first == 0 for first, _ in manners) - 1
        self._manners = manners[max(over, 0) :]
        self._arrays = None


class SlowTrack:
    """A slow signal, scalar or vector: times and values."""

    __slots__ = ("_rows",)

    def __init__(self) -> None:
        self._rows = Rows()

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def first(self) -> float:
        """Time of the oldest value; inf if there is none."""
        return self._rows.first

    @property
    def last(self) -> float:
        """Time of the newest value; -inf if there is none."""
        return self._rows.last

    def add(self, t: float, x: tuple[float, ...]) -> bool:
        """Keep a value unless it is late or not finite."""
        if not t > self._rows.last or not math.isfinite(t + sum(x)):
            return False
        self._rows.add(t, x)
        return True

    def extend(self, t: Array, x: Array) -> None:
        """Keep values (n, d) at increasing times (n,) that are newer, all of them finite."""
        self._rows.extend(t, x)

    def arrays(self) -> tuple[Array, Array]:
        """Times (n,) and values (n, d)."""
        t, x = self._rows.arrays()
        return t.copy(), x.copy()

    def around(self, first: float, last: float) -> tuple[Array, Array]:
        """The same of what is between two times, s, and one value to either side."""
        t, x = self._rows.arrays()
        begin = max(int(np.searchsorted(t, first)) - 1, 0)
        end = int(np.searchsorted(t, last, side="right")) + 1
        return t[begin:end].copy(), x[begin:end].copy()

    def drop_before(self, t: float) -> None:
        """Forget what is older than ``t``, but keep the last two values."""
        i = int(np.searchsorted(self._rows.arrays()[0], t))
        self._rows.drop(min(i, max(len(self._rows) - 2, 0)))


def _reported(fix: GpsFix) -> tuple[float | None, ...]:
    """What a receiver has measured of where it is and how it moves."""
    return fix.latitude, fix.longitude, fix.altitude, fix.v_n, fix.v_e, fix.v_d


class FixTrack:
    """GPS fixes: repeats dropped, times put on the receiver's own even grid.

    Attributes:
        moved: stamp of the newest fix that shows motion, by speed or by height, or before which
            there was an outage, s; -inf: there is none.
    """

    __slots__ = ("_fixes", "_height", "_last_even", "_offsets", "moved", "refused")

    def __init__(self) -> None:
        self.moved = -np.inf
        self._height = np.nan
        """Where it was then, m; before that, where it was first."""
        self._fixes: list[tuple[GpsFix, bool]] = []
        self._offsets: list[tuple[float, float]] = []
        self._last_even = -np.inf
        self.refused: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._fixes)

    @property
    def first(self) -> float:
        """Stamp of the oldest fix that waits; inf if there is none."""
        return self._fixes[0][0].t if self._fixes else np.inf

    @property
    def last(self) -> float:
        """Stamp of the newest fix; -inf if there is none."""
        return self._fixes[-1][0].t if self._fixes else -np.inf

    @property
    def reach(self) -> Reach:
        """How far from the fixes that wait samples are needed."""
        return reach_of((self.last - self.first) / (len(self) - 1) if len(self) > 1 else 0.0)

    def add(self, fix: GpsFix, *, trusted: bool) -> bool:
        """Keep a new fix; False for the repeats that a faster stream sends between fixes."""
        if self._fixes:
            before = self._fixes[-1][0]
            # Of a receiver whose time is coarse several fixes have the same one.
            at_once = fix.t_receiver is not None and fix.t_receiver == before.t_receiver
            same = at_once and _reported(fix) == _reported(before)
            if same or not fix.t > before.t:
                self.refused["gps_repeated" if same or fix.t == before.t else "gps_late"] += 1
                return False
            if self._moves(fix, before):
                self.moved, self._height = fix.t, fix.altitude
        else:
            self._height = fix.altitude
        self._fixes.append((fix, trusted))
        return True

    def _moves(self, fix: GpsFix, before: GpsFix) -> bool:
        still = (
            math.hypot(fix.v_n, fix.v_e, fix.v_d or 0.0) < STILL_M_S
            # Not every receiver tells how fast it sinks, and some land slowly.
            and abs(fix.altitude - self._height) < GROUND_M
            and fix.t - before.t < LONGEST_FIX_GAP_S
        )
        return not still

    def motion(self, until: float) -> tuple[Array, Array, Array]:
        """Of what waits up to ``until``: times, s, heights, m, and speeds over ground, m/s."""
        waiting = [f for f, _ in self._fixes if f.t <= until]
        v_n = np.array([(f.v_n, f.v_e) for f in waiting]).reshape(-1, 2)
        return (
            np.array([f.t for f in waiting]),
            np.array([f.altitude for f in waiting]),
            np.hypot(v_n[:, 0], v_n[:, 1]),
        )

    def take(self, until: float) -> tuple[list[GpsFix], NDArray[np.bool_], Array]:
        """Fixes up to ``until``, their trust and even times; the last stays as the next first."""
        n = int(np.searchsorted([f.t for f, _ in self._fixes], until, side="right"))
        taken = self._fixes[:n]
        fixes = [f for f, _ in taken]
        t = even_times(
            np.array([f.t for f in fixes]),
            None
            if any(f.t_receiver is None for f in fixes)
            else np.array([f.t_receiver for f in fixes], dtype=np.float64),
        )
        if np.isfinite(self._last_even) and len(t) > 1:
            # The first was the last of before: its time must not move under the filter's feet.
            t[0] = min(self._last_even, t[1] - BEFORE_NEXT_S)
        if len(t):
            self._last_even = float(t[-1])
        self._fixes = self._fixes[max(n - 1, 0) :]
        return fixes, np.array([trusted for _, trusted in taken], dtype=bool), t

    def clear(self) -> None:
        """Forget all fixes (reboot)."""
        self._fixes.clear()
        self._last_even = self.moved = -np.inf
        self._height = np.nan
