"""What a pass leaves behind: sums of a block, and on request every epoch."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block


@dataclass(frozen=True, slots=True)
class EpochState:
    """State of the filter after an epoch: where dead reckoning may start.

    Attributes:
        t: time on the boot clock, s.
        innovation: (3,) velocity innovation at the current estimate, NED, m/s; NaN down where the
            receiver has no vertical speed.
        R_nb: (3, 3) body axes to NED.
        v_n: (3,) velocity, NED, m/s.
        bias_b: (3,) gyroscope bias, body axes, rad/s.
    """

    t: float
    innovation: Array
    R_nb: Array
    v_n: Array
    bias_b: Array


STATE_NUMBERS = 1 + 3 + 9 + 3 + 3
"""Of the fields of :class:`EpochState`, in their order."""
TOGETHER = 1024
"""Epochs whose residuals are found at once [cost]."""


class StateLog:
    """States after many epochs, the latest.

    Rows of numbers: as objects they are five times as large, and there are thousands of them in
    every copy of a flight.
    """

    __slots__ = ("_most", "_parts")

    def __init__(self, most: int) -> None:
        """Take how many are kept at the least once there are as many."""
        self._most = most
        self._parts: deque[Array] = deque()

    def add(self, rows: Array) -> None:
        """Take the :func:`state_row` of n epochs, (n, STATE_NUMBERS)."""
        if not len(rows):
            return
        self._parts.append(rows)
        kept = len(self)
        while kept - len(self._parts[0]) >= self._most:
            kept -= len(self._parts.popleft())

    def clear(self) -> None:
        """Forget all of them."""
        self._parts.clear()

    def __len__(self) -> int:
        return sum(map(len, self._parts))

    @property
    def t(self) -> Array:
        """(n,) times of all of them, s: no objects are made for these alone."""
        return np.concatenate([np.zeros(0), *(rows[:, 0] for rows in self._parts)])

    @property
    def innovation(self) -> Array:
        """(n, 3) their velocity innovations, m/s."""
        return np.concatenate([np.zeros((0, 3)), *(rows[:, 1:4] for rows in self._parts)])

    def __iter__(self) -> Iterator[EpochState]:
        for rows in self._parts:
            for row in rows:
                yield EpochState(
                    float(row[0]), row[1:4], row[4:13].reshape(3, 3), row[13:16], row[16:]
                )


def state_row(state: EpochState) -> Array:
    """(1, STATE_NUMBERS) the numbers of a state, in the order of its fields."""
    return np.hstack((state.t, state.innovation, state.R_nb.ravel(), state.v_n, state.bias_b))[None]


@dataclass(frozen=True, slots=True)
class EpochTrace:
    """What one epoch measured, for plots, gates and for finding where in a flight an effect is.

    The velocity residual at unknowns ``theta`` is ``innovation - columns @ theta``; the whitened
    innovations there are ``y - h @ theta``, which are many, and kept only if they are asked for.

    Attributes:
        t: time on the boot clock, s.
        innovation: (v,) velocity innovation at ``theta = 0``, NED, m/s.
        columns: (v, m) its regressors, in single precision: a millionth of a residual matters to
            nobody, an hour's bytes do.
        y: (r,) whitened innovations at ``theta = 0``; empty if they are not kept.
        h: (r, m) their regressors; (0, m) if they are not kept.
        velocities: v, how many of the r are of velocity: they come first.
        height: whether one of height follows; the rest are of attitude.
        refused: names of what the gates refused.
        refused_by: (2 or 3,) innovation of a velocity that was refused, NED, m/s; else empty.
    """

    t: float
    innovation: Array
    columns: NDArray[np.floating]
    y: Array
    h: Array
    velocities: int
    height: bool
    refused: tuple[str, ...]
    refused_by: Array


class Traces:
    """What n epochs measured, side by side: as objects they would be three times as large.

    Attributes:
        refused: names of what the gates refused, by the number of the epoch.
        refused_by: (2 or 3,) innovation of a velocity that was refused, likewise.
    """

    __slots__ = (
        "_columns",
        "_count",
        "_innovation",
        "_rows",
        "_t",
        "_velocities",
        "refused",
        "refused_by",
    )

    def __init__(self, room: int = 0, m: int = 0) -> None:
        """Take for how many epochs there is room at first, and how many unknowns there are."""
        self._count = 0
        self._t = np.empty(room)
        self._velocities = np.empty(room, dtype=np.int64)
        self._innovation = np.empty((room, 3))
        self._columns = np.empty((room, 3, m), dtype=np.float32)
        self._rows: list[tuple[Array, bool]] = []
        self.refused: dict[int, tuple[str, ...]] = {}
        self.refused_by: dict[int, Array] = {}

    def add(self, t: Array, velocities: NDArray[np.int64], shown: Array) -> None:
        """Take k epochs.

        Args:
            t: (k,) time on the boot clock, s.
            velocities: (k,) how many components of velocity each has.
            shown: (sum of velocities, m + 1) velocity innovations at ``theta = 0``, NED, m/s, and
                their regressors.
        """
        new = self._next(len(t))
        self._t[new], self._velocities[new] = t, velocities
        innovation, columns = self._innovation[new], self._columns[new]
        there = np.arange(3) < np.reshape(velocities, (-1, 1))
        innovation[~there], columns[~there] = np.nan, 0.0
        innovation[there], columns[there] = shown[:, 0], shown[:, 1:]

    def add_refused(self, names: tuple[str, ...], by: Array) -> None:
        """What was refused of the last epoch."""
        if names:
            self.refused[self._count - 1] = names
        if len(by):
            self.refused_by[self._count - 1] = by

    def add_rows(self, rows: Array, *, height: bool) -> None:
        """(r, m + 1) all that was whitened of the next epoch: of every one, or of none."""
        self._rows.append((rows, height))

    def extend(self, others: Traces) -> None:
        """Take the epochs of others, too."""
        if not len(others):
            return  # of a segment that began nothing, for how many unknowns nobody knows
        first, new = self._count, self._next(len(others))
        self._t[new], self._velocities[new] = others.t, others.velocities
        self._innovation[new], self._columns[new] = others.innovation, others.columns
        self._rows += others._rows
        self.refused |= {first + i: names for i, names in others.refused.items()}
        self.refused_by |= {first + i: by for i, by in others.refused_by.items()}

    def at(self, theta: Array) -> Traces:
        """The same with innovations at ``theta`` (m,), their regressors left out."""
        out, n = Traces(len(self)), len(self)
        out._t[:], out._velocities[:], out._count = self.t, self.velocities, n
        out._innovation[:] = residual(self.innovation, self.columns, theta)
        out.refused, out.refused_by = dict(self.refused), dict(self.refused_by)
        return out

    def keep_first(self, m: int) -> None:
        """Keep the first ``m`` regressors alone."""
        self._columns = self._columns[:, :, :m].copy()
        self._rows = [(rows[:, : m + 1], height) for rows, height in self._rows]

    def _next(self, count: int) -> slice:
        """Places of the next epochs; where room is short there is made twice as much."""
        first, self._count = self._count, self._count + count
        if self._count > len(self._t):
            more = max(2 * len(self._t), self._count) - len(self._t)
            for name in ("_t", "_velocities", "_innovation", "_columns"):
                old = getattr(self, name)
                room = np.empty((more, *old.shape[1:]), dtype=old.dtype)
                setattr(self, name, np.concatenate([old, room]))
        return slice(first, self._count)

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[EpochTrace]:
        nothing, m = np.zeros(0), self._columns.shape[2]
        for i, (t, v) in enumerate(zip(self.t.tolist(), self.velocities.tolist(), strict=True)):
            rows, height = self._rows[i] if self._rows else (np.zeros((0, m + 1)), False)
            yield EpochTrace(
                t,
                self._innovation[i, :v],
                self._columns[i, :v],
                rows[:, 0],
                rows[:, 1:],
                v,
                height,
                self.refused.get(i, ()),
                self.refused_by.get(i, nothing),
            )

    @property
    def t(self) -> Array:
        """(n,) times on the boot clock, s."""
        return self._t[: self._count]

    @property
    def velocities(self) -> NDArray[np.int64]:
        """(n,) how many components of velocity each has."""
        return self._velocities[: self._count]

    @property
    def innovation(self) -> Array:
        """(n, 3) velocity innovation at ``theta = 0``, NED, m/s; NaN where there is none."""
        return self._innovation[: self._count]

    @property
    def columns(self) -> NDArray[np.float32]:
        """(n, 3, m) its regressors; zero where there is none."""
        return self._columns[: self._count]


def residual(innovation: Array, columns: NDArray[np.floating], theta: Array) -> Array:
    """(n, 3) what unknowns ``theta`` (m,) leave of innovations (n, 3) with columns (n, 3, m)."""
    out = innovation.copy()
    # Some at a time: all of a day's in double precision would be much.
    for first in range(0, len(out), TOGETHER):
        part = slice(first, first + TOGETHER)
        out[part] -= columns[part] @ theta
    return out


@dataclass(slots=True)
class PassResult:
    """What a pass has made of one segment.

    Attributes:
        block: its sums.
        states: (n, STATE_NUMBERS) each, after every epoch whose velocity was taken.
        traces: of every epoch, if the pass keeps them.
        refused: how many measurements the gates refused, by name.
        epochs: how many fixes were gone through.
    """

    block: Block
    states: list[Array] = field(default_factory=list)
    traces: Traces = field(default_factory=Traces)
    refused: dict[str, int] = field(default_factory=dict)
    epochs: int = 0
