"""Dead reckoning: how far velocity drifts when it is only integrated, for several calibrations.

It starts from the filter's velocity at an epoch and integrates

    dv_n/dt = R_nb f_b + (0, 0, g) - (2 w_ie + w_en) x v_n

along the filter's attitude, so that what is left is the accelerometer's error and not the
gyroscope's drift; it is compared with GPS where GPS is there to tell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias
from weakref import ReferenceType, ref

import numpy as np

from onboard.core.estimate.limits import (
    FEWEST_INTERVALS,
    LONG_DRIFTS,
    MOST_KNOWN,
    SAME_EPOCH_S,
    WHOLE_SHARE,
)
from onboard.core.filter.traces import EpochState
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY, carried_and_turning_of
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.maths.small_turns import turn_by
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.quadrature import NodeMaker

_Piece: TypeAlias = tuple[ReferenceType[Segment], ReferenceType[Fixes]]


@dataclass(frozen=True, slots=True)
class Drift:
    """Drift of dead reckoning for several calibrations, median over windows.

    Attributes:
        horizon_s: length of a window, s.
        end: (sets,) length of the velocity error at a window's end, m/s.
        rms: (sets,) root mean square of it inside, m/s.
        windows: how many.
    """

    horizon_s: float
    end: Array
    rms: Array
    windows: int


def free_drift(
    chain: Chain,
    states: Sequence[EpochState],
    sixes: Sequence[Array],
    *,
    horizon_s: float,
    most: int = LONG_DRIFTS,
) -> Drift | None:
    """Integrate freely over windows spread over the flight.

    Args:
        chain: integrals between epochs (:func:`intervals`), in order of time.
        states: filter states at epochs.
        sixes: sets to compare, each (6,) scale (1) and beta (m/s^2), sensor axes.
        horizon_s: length of a window.
        most: windows at the most.

    Returns:
        Median over windows per set; None if no window fits.
    """
    if not len(chain) or not states:
        return None
    start, end = chain.start, chain.end
    ends, squares = [], []
    last = -np.inf
    span = float(end[-1] - start[0])
    spacing = max(horizon_s, span / most)
    attitude = {round(state.t, 3): state.R_nb for state in states}
    for state in states:
        # Epochs are on a grid: the sum must not decide by rounding.
        if state.t < last + spacing - SAME_EPOCH_S:
            continue
        k = int(np.searchsorted(start, state.t - SAME_EPOCH_S))
        if k >= len(chain) or abs(start[k] - state.t) > SAME_EPOCH_S:
            continue
        stop = int(np.searchsorted(end, state.t + horizon_s + SAME_EPOCH_S, side="right"))
        if stop - k < FEWEST_INTERVALS or end[stop - 1] - state.t < WHOLE_SHARE * horizon_s:
            continue
        if np.any(np.abs(start[k + 1 : stop] - end[k : stop - 1]) > 1e-6):
            continue
        got = _drift(chain[k:stop], state, sixes, attitude)
        if got is None:
            continue
        ends.append(got[0])
        squares.append(got[1])
        last = state.t
        if len(ends) == most:
            break
    if not ends:
        return None
    return Drift(
        horizon_s,
        np.median(np.array(ends), axis=0),
        np.sqrt(np.median(np.array(squares), axis=0)),
        len(ends),
    )


@dataclass(frozen=True, slots=True)
class FreeErrors:
    """Velocity errors of free integration, window after window.

    Attributes:
        t: (n,) epochs, s, boot clock.
        error: (sets, n) length of integrated minus GPS velocity, m/s; NaN begins a window.
    """

    t: Array
    error: Array


def free_errors(
    chain: Chain,
    states: Sequence[EpochState],
    sixes: Sequence[Array],
    *,
    horizon_s: float,
) -> FreeErrors:
    """Integrate freely from each state that the window before has reached.

    Args:
        chain: integrals between epochs (:func:`intervals`), in order of time.
        states: filter states at epochs.
        sixes: sets to compare, each (6,) scale (1) and beta (m/s^2), sensor axes.
        horizon_s: length of a window.
    """
    start, end = chain.start, chain.end
    attitude = {round(state.t, 3): state.R_nb for state in states}
    times, errors = [np.zeros(0)], [np.zeros((len(sixes), 0))]
    reached = -np.inf
    for state in states:
        k = int(np.searchsorted(start, state.t - SAME_EPOCH_S))
        if (
            state.t < reached - SAME_EPOCH_S
            or k >= len(chain)
            or abs(start[k] - state.t) > SAME_EPOCH_S
        ):
            continue
        stop = k + 1
        while (
            stop < len(chain)
            and abs(start[stop] - end[stop - 1]) < 1e-6
            and end[stop] - state.t < horizon_s + SAME_EPOCH_S
        ):
            stop += 1
        error = _errors(chain[k:stop], state, sixes, attitude)
        seen = np.isfinite(error[0, :, 0])
        length = np.linalg.norm(error[:, seen], axis=2)
        times += [np.array([state.t]), end[k:stop][seen]]
        errors += [np.full((len(sixes), 1), np.nan), length]
        reached = float(end[stop - 1])
    return FreeErrors(np.concatenate(times), np.concatenate(errors, axis=1))


@dataclass(frozen=True, slots=True)
class Chain:
    """Integrals of n intervals between epochs, in order of time, in body axes of their starts.

    Attributes:
        start: (n,) s, boot clock, latency removed.
        end: (n,) s.
        turn: (n, 3, 3) body axes at the end to those at the start.
        by_scale: (n, 3, 3) velocity gained per unit of each scale, m/s.
        by_offset: (n, 3, 3) velocity gained per unit of each beta, s.
        velocity: (n, 3) of GPS at the end, NED, m/s; NaN where there is none.
        latitude: (n,) there, rad.
    """

    start: Array
    end: Array
    turn: Array
    by_scale: Array
    by_offset: Array
    velocity: Array
    latitude: Array

    def __len__(self) -> int:
        return len(self.start)

    def __getitem__(self, some: slice) -> Chain:
        """Some of them in a row."""
        return Chain(*(getattr(self, f.name)[some] for f in fields(self)))


def intervals(pieces: Sequence[tuple[Segment, Fixes]], point: Linearisation) -> Chain:
    """Integrals between the epochs of batches of flight, each with its fixes, in order of time.

    ``point`` is the linearisation (GPS latency, averaging span).
    """
    n = sum(max(len(fixes) - 1, 0) for _, fixes in pieces)
    out = Chain(*(np.empty((n, *shape)) for shape in ((), (), (3, 3), (3, 3), (3, 3), (3,), ())))
    first = 0
    for segment, fixes in pieces:
        if len(fixes) > 1:
            made = _of_piece(segment, fixes, point)
            for f in fields(Chain):
                getattr(out, f.name)[first : first + len(made)] = getattr(made, f.name)
            first += len(made)
    return out


class KnownIntervals:
    """Integrals of batches of flight, kept for the next time that the same are asked for.

    In flight an answer is worked out every now and then, and all but a batch or two are the ones of
    before; a report asks for what the answer has asked for.  Of hours nothing is kept, nor flight
    that nobody else keeps.
    """

    __slots__ = ("_known", "_point")

    def __init__(self) -> None:
        self._point: Linearisation | None = None
        self._known: dict[tuple[int, int], tuple[_Piece, Chain]] = {}

    def __deepcopy__(self, memo: object) -> KnownIntervals:
        return KnownIntervals()  # whoever copies a flight asks once

    def of(self, pieces: Sequence[tuple[Segment, Fixes]], point: Linearisation) -> Chain:
        """The same as :func:`intervals`."""
        before = self._known if point == self._point else {}
        self._point, self._known = point, {}
        if not 0 < len(pieces) <= MOST_KNOWN:
            return intervals(pieces, point)
        for segment, fixes in pieces:
            key = id(segment), id(fixes)
            of, chain = before.get(key, (None, None))
            # Of an object that is gone another may have the number.
            if of is None or chain is None or of[0]() is not segment or of[1]() is not fixes:
                of, chain = (ref(segment), ref(fixes)), intervals([(segment, fixes)], point)
            self._known[key] = of, chain
        chains = [chain for _, chain in self._known.values()]
        return Chain(*(np.concatenate([getattr(c, f.name) for c in chains]) for f in fields(Chain)))


def _of_piece(segment: Segment, fixes: Fixes, point: Linearisation) -> Chain:
    """Those of one batch."""
    t = point.true_time(fixes.t)
    nodes = NodeMaker(segment, np.zeros(3), point.six).intervals(t[:-1], t[1:])
    by_scale = nodes.integrals(segment.R_bs * nodes.signals.raw_s[..., None, :])[0]
    eye = np.broadcast_to(np.eye(3), (*nodes.signals.t.shape, 3, 3))
    whole = nodes.integrals(eye)[0]
    turn = nodes.P[:, -1].copy()  # a view would keep every node's attitude alive
    by_offset = whole @ segment.R_bs
    return Chain(t[:-1], t[1:], turn, by_scale, by_offset, fixes.v_n[1:], fixes.latitude[1:])


def _drift(
    chain: Chain,
    state: EpochState,
    sixes: Sequence[Array],
    attitude: Mapping[float, Array],
) -> tuple[Array, Array] | None:
    """Drift at the end and mean square inside for each set; None without GPS at the end."""
    error = _errors(chain, state, sixes, attitude)
    seen = np.isfinite(error[0, :, 0])
    if not np.any(seen):
        return None
    heard = error[:, seen]
    square = np.sum(heard**2, axis=(1, 2)) / heard.shape[1]
    return np.linalg.norm(heard[:, -1], axis=1), square


def _errors(
    chain: Chain,
    state: EpochState,
    sixes: Sequence[Array],
    attitude: Mapping[float, Array],
) -> Array:
    """(sets, n, 3) integrated minus GPS velocity at the ends of the chain, m/s.

    A whole row is NaN where there is no GPS; down is 0 where the receiver has no vertical speed.
    """
    R = state.R_nb
    sets = np.array(sixes)
    gained = chain.by_scale @ sets[:, :3].T + chain.by_offset @ sets[:, 3:].T
    v = [state.v_n.tolist()] * len(sets)
    every = np.empty((len(sets), len(chain), 3))
    times = zip(chain.start.tolist(), chain.end.tolist(), chain.latitude.tolist(), strict=True)
    for k, (start, end, latitude) in enumerate(times):
        T = end - start
        for i, push in enumerate((R @ gained[k]).T.tolist()):
            coriolis, turning = carried_and_turning_of(latitude, *v[i])
            pulled = 0.0, 0.0, STANDARD_GRAVITY * T
            v[i] = [
                x + (p + c * T + g) for x, p, c, g in zip(v[i], push, coriolis, pulled, strict=True)
            ]
        every[:, k] = v
        at_end = attitude.get(round(end, 3))
        if at_end is None:
            # The bias turns the interval's increments by R(-b T) to first order.
            off = rotation_from_vector(-state.bias_b * T)
            at_end = turn_by(-np.array(turning) * T) @ R @ chain.turn[k] @ off
        R = at_end
    seen = np.isfinite(chain.velocity)
    error: Array = np.where(seen, every - chain.velocity, 0.0)
    error[:, ~seen[:, 0]] = np.nan
    return error
