"""How far velocity drifts when it is only integrated: the parameters in force against the estimate.

Starts from the filter's velocity at an epoch and integrates the accelerometer alone along the
filter's attitude, so that what is left is the accelerometer's error and not the gyroscope's drift;
compared with GPS where GPS is there to tell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.traces import EpochState
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.quadrature import NodeMaker


@dataclass(frozen=True, slots=True)
class Drift:
    """Drift (m/s) per window at its end, and root mean square inside, for several sets of six."""

    horizon_s: float
    end: Array
    rms: Array
    windows: int


def free_drift(
    chain: Sequence[Interval],
    states: Sequence[EpochState],
    sixes: Sequence[Array],
    *,
    horizon_s: float,
    most: int = 6,
) -> Drift | None:
    """Integrate freely over windows spread over the flight.

    Args:
        chain: integrals between epochs (:func:`intervals`), in order of time.
        states: filter states at epochs.
        sixes: sets of (6,) scale, beta to compare.
        horizon_s: length of a window.
        most: windows at the most.

    Returns:
        Median over windows per set; None if no window fits.
    """
    if not chain or not states:
        return None
    start = np.array([x.start for x in chain])
    end = np.array([x.end for x in chain])
    ends, squares = [], []
    last = -np.inf
    span = chain[-1].end - chain[0].start
    spacing = max(horizon_s, span / most)
    attitude = {round(state.t, 3): state.R_nb for state in states}
    for state in states:
        if state.t < last + spacing:
            continue
        k = int(np.searchsorted(start, state.t - 1e-3))
        if k >= len(chain) or abs(start[k] - state.t) > 1e-3:
            continue
        stop = int(np.searchsorted(end, state.t + horizon_s + 1e-3, side="right"))
        if stop - k < 3 or end[stop - 1] - state.t < 0.97 * horizon_s:
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
    chain: Sequence[Interval],
    states: Sequence[EpochState],
    sixes: Sequence[Array],
    *,
    horizon_s: float,
) -> FreeErrors:
    """Integrate freely from each state that the window before has reached.

    Args:
        chain: integrals between epochs (:func:`intervals`), in order of time.
        states: filter states at epochs.
        sixes: sets of (6,) scale, beta to compare.
        horizon_s: length of a window.
    """
    start = np.array([x.start for x in chain])
    end = np.array([x.end for x in chain])
    attitude = {round(state.t, 3): state.R_nb for state in states}
    times, errors = [np.zeros(0)], [np.zeros((len(sixes), 0))]
    reached = -np.inf
    for state in states:
        k = int(np.searchsorted(start, state.t - 1e-3))
        if state.t < reached - 1e-3 or k >= len(chain) or abs(start[k] - state.t) > 1e-3:
            continue
        stop = k + 1
        while (
            stop < len(chain)
            and abs(start[stop] - end[stop - 1]) < 1e-6
            and end[stop] - state.t < horizon_s + 1e-3
        ):
            stop += 1
        error = _errors(chain[k:stop], state, sixes, attitude)
        seen = np.isfinite(error[0, :, 0])
        length = np.linalg.norm(error[:, seen], axis=2)
        times += [np.array([state.t]), end[k:stop][seen]]
        errors += [np.full((len(sixes), 1), np.nan), length]
        reached = float(end[stop - 1])
    return FreeErrors(np.concatenate(times), np.concatenate(errors, axis=1))


def intervals(pieces: Sequence[tuple[Segment, Fixes]], point: Linearisation) -> list[Interval]:
    """Integrals between the epochs of batches of flight, each with its fixes, in order of time.

    ``point`` is the linearisation (GPS latency, averaging span).
    """
    return [x for segment, fixes in pieces for x in Interval.of_piece(segment, fixes, point)]


@dataclass(frozen=True, slots=True)
class Interval:
    """Integrals of one interval between epochs, body axes of its start."""

    start: float
    end: float
    turn: Array
    by_scale: Array
    by_offset: Array
    by_bias: Array
    velocity: Array

    @staticmethod
    def of_piece(segment: Segment, fixes: Fixes, point: Linearisation) -> list[Interval]:
        """Those of one batch."""
        t = point.true_time(fixes.t)
        if len(t) < 2:
            return []
        nodes = NodeMaker(segment, np.zeros(3), point.six).intervals(t[:-1], t[1:])
        by_scale = nodes.integrals(segment.R_bs * nodes.signals.raw_s[..., None, :])[0]
        eye = np.broadcast_to(np.eye(3), (*nodes.signals.t.shape, 3, 3))
        whole = nodes.integrals(eye)[0]
        return [
            Interval(
                float(t[k]),
                float(t[k + 1]),
                nodes.P[k, -1],
                by_scale[k],
                whole[k] @ segment.R_bs,
                whole[k],
                fixes.v_n[k + 1],
            )
            for k in range(len(t) - 1)
        ]


def _drift(
    chain: Sequence[Interval],
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
    chain: Sequence[Interval],
    state: EpochState,
    sixes: Sequence[Array],
    attitude: Mapping[float, Array],
) -> Array:
    """(sets, n, 3) integrated minus GPS velocity at the ends of the chain, m/s.

    A whole row is NaN where there is no GPS; down is 0 where the receiver has no vertical speed.
    """
    R = state.R_nb
    v = np.tile(state.v_n, (len(sixes), 1))
    error = np.full((len(sixes), len(chain), 3), np.nan)
    for k, x in enumerate(chain):
        T = x.end - x.start
        # The bias turns the interval's increments by R(-b T) to first order.
        for i, six in enumerate(sixes):
            v[i] += R @ (x.by_scale @ six[:3] + x.by_offset @ six[3:])
            v[i, 2] += STANDARD_GRAVITY * T
        at_end = attitude.get(round(x.end, 3))
        if at_end is None:
            at_end = R @ x.turn @ rotation_from_vector(-state.bias_b * T)
        R = at_end
        seen = np.isfinite(x.velocity)
        if seen[0]:
            error[:, k] = np.where(seen, v - x.velocity, 0.0)
    return error
