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
    traces: list[EpochTrace] = field(default_factory=list)
    refused: dict[str, int] = field(default_factory=dict)
    epochs: int = 0
