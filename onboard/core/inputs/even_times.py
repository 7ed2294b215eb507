"""Times of fixes without the jitter of their stamps."""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import (
    CRYSTAL,
    EVEN_ALREADY_S,
    FEWEST_EVEN,
    LEAST_JITTER_S,
    MISSED,
    MOST_MISSED,
    NO_GRID_S,
    OFF_GRID,
    REWEIGHTINGS,
    UNEVEN,
    WAITED_S,
    WHOLE_MS,
)
from onboard.core.maths.arrays import Array


def even_times(t: Array, t_receiver: Array | None) -> Array:
    """De-jittered epoch times on the boot clock.

    Epochs are even in receiver time; their arrival stamps jitter by 10-20 ms.  With the receiver's
    own time the stamps are its clock plus a straight line (offset and drift); without it, or where
    it is less even than they are, the epochs are numbered by the likeliest even grid.  A line is
    fitted robustly over the batch; stamps that are even already stay as they are.

    Args:
        t: (n,) stamps, s, increasing.
        t_receiver: (n,) receiver times, s, or None.

    Returns:
        (n,) strictly increasing times, s.
    """
    if len(t) < FEWEST_EVEN:
        return t.copy()
    clock = _clock(t, t_receiver)
    if clock is None:
        return t.copy()
    offset = t - t[0] - clock
    if not EVEN_ALREADY_S <= float(np.ptp(offset)) <= NO_GRID_S:
        return t.copy()
    even: Array = t[0] + clock + _robust_line(clock - clock.mean(), offset)
    return even


def _clock(t: Array, t_receiver: Array | None) -> Array | None:
    """(n,) receiver time since the first epoch, s; None if the stamps show none."""
    own, counted = _own_time(t_receiver), _counted(t)
    if own is None:
        return counted
    its = _counted(own)
    if counted is None or its is None or _scatter(own - its) <= UNEVEN * _scatter(t - counted):
        return own
    # What a receiver measures at a time that its own clock has right arrives at best as evenly: the
    # wait of a message comes on top.  This time is another one, or it was rounded.
    return counted


def _own_time(t_receiver: Array | None) -> Array | None:
    """(n,) s since the first epoch by the receiver; None where it stands still between fixes."""
    if t_receiver is None or not np.all(np.diff(t_receiver) > 0):
        return None
    since: Array = t_receiver - t_receiver[0]
    return since


def _counted(t: Array) -> Array | None:
    """(n,) s since the first epoch by the numbers of whole periods; None if there is none."""
    count = _numbers(t - t[0])
    if count is None:
        return None
    # A period that is told from few epochs is off by a millisecond, which adds up over a batch:
    # good enough to number the epochs, not to say when they were.
    period = float(np.polyfit(count, t - t[0], 1)[0])
    whole = round(period * 1e3)
    counted: Array = count * (whole * 1e-3 if abs(period * 1e3 - whole) < WHOLE_MS else period)
    return counted


def _numbers(since: Array) -> Array | None:
    """(n,) number of each epoch, from 0 on; None if there is no grid.

    Messages wait by up to half a period (a receiver's ten a second come 64 and 136 ms after one
    another where a log is written every 40), and some are lost.  Of all numbers of epochs that may
    be missing the likeliest: each has a period, and stamps scatter about its grid.
    """
    n = len(since)
    if since[-1] <= 0.0:
        return None
    missing = np.arange(min(n, MOST_MISSED) + 1)
    phase = np.outer((n - 1 + missing) / since[-1], since)
    middle = np.angle(np.exp(2j * np.pi * phase).mean(axis=1)) / (2.0 * np.pi)
    phase -= middle[:, None]
    count = np.round(phase)
    period = since[-1] / (n - 1 + missing)
    share = (phase - count).std(axis=1)
    likely = -n * np.log(np.maximum(share * period, WAITED_S)) - missing * MISSED
    likely[(share > OFF_GRID) | np.any(np.diff(count, axis=1) < 1.0, axis=1)] = -np.inf
    best = int(np.argmax(likely))
    if not np.isfinite(likely[best]):
        return None
    numbers: Array = count[best] - count[best, 0]
    return numbers


def _scatter(offset: Array) -> float:
    """Standard deviation, s, at least of what is even."""
    return max(float(np.std(offset)), EVEN_ALREADY_S)


def _robust_line(x: Array, y: Array) -> Array:
    """(n,) straight line through ``y`` at ``x`` (both (n,), s), outliers weighted down."""
    weight, line = np.ones(len(x)), np.zeros(len(x))
    for _ in range(REWEIGHTINGS):
        mean = float(np.average(y, weights=weight))
        spread = float(weight @ (x * x))
        # Over one batch the slope is noise, unless it is long.
        slope = float(np.clip(weight @ (x * (y - mean)) / spread, -CRYSTAL, CRYSTAL))
        line = mean + slope * x
        residual = np.abs(y - line)
        scale = max(float(np.median(residual)), LEAST_JITTER_S)
        weight = 1.0 / np.maximum(1.0, residual / (2.0 * scale))
    return line
