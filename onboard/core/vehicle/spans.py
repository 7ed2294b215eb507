"""When the vehicle was in the air: what the motion and the outputs say, whatever the flags say."""

from __future__ import annotations

import math

import numpy as np

from onboard.core.inputs.limits import GROUND_M, STILL_M_S
from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.limits import HEIGHT_WANDER_M, LEVEL_M_S, MARGIN_S, STILL_S


def grounded_spans(
    t: Array,
    v_n: Array,
    height: Array,
    *,
    said: Mask | None = None,
    carried: Mask | None = None,
    rolls: bool = False,
    wings: bool = False,
) -> list[tuple[float, float]]:
    """Intervals (s) in which a vehicle stands on the ground, with a margin to either side.

    A hover is still, too: only what is as low as the lowest such place counts, and what the
    autopilot says of it: from one flight to the next a receiver's height wanders by metres.  Wings
    hold no hover, so that a plane's stands may differ by that from the take-off to the landing.

    Args:
        t: (n,) times of fixes, s.
        v_n: (n, 3) velocity, m/s; NaN down where it is not measured.
        height: (n,) m.
        said: (n,) where the autopilot says that it stands; a word that is not taken back in the
            air costs what is still.
        carried: (n,) where rotors lift as much as in flight.  A recording that has no other stand
            was begun and ended in the air, and knows no ground.
        rolls: whether it may move on the ground: then what is level, and as low as where it
            stands before or after, is the ground.
        wings: whether it is a plane.
    """
    if len(t) < 2:
        return []
    height = lasting_height(t, height)
    v_n = np.where(np.isnan(v_n), np.stack([0.0 * t, 0.0 * t, -_climb(t, height)], axis=1), v_n)
    slow = np.linalg.norm(v_n, axis=1) < STILL_M_S
    if carried is not None and np.all([np.mean(carried[i:j]) > 0.5 for i, j in _lasting(t, slow)]):
        return []
    runs = _lasting(t, slow)
    stands = [] if said is None else _lasting(t, slow & said)
    apart_m = HEIGHT_WANDER_M if wings else GROUND_M
    if rolls:
        level = np.abs(v_n[:, 2]) < LEVEL_M_S
        low = height < _ground(t, height, runs, apart_m) + GROUND_M
        runs += _lasting(t, level & low)
    levels = [float(np.median(height[i:j])) for i, j in runs]
    lowest = min(levels, default=np.inf)
    # A flight that is recorded in parts may begin in a hover: nothing was lower then either.
    if float(np.percentile(height, 1)) >= lowest - apart_m:
        stands += [
            run for run, level_m in zip(runs, levels, strict=True) if level_m < lowest + apart_m
        ]
    return [(float(t[i]) - MARGIN_S, float(t[j - 1]) + MARGIN_S) for i, j in sorted(stands)]


def lasting_height(t: Array, height: Array) -> Array:
    """(n,) height, m, without what does not last as long as a stand has to: a damaged fix is none.

    The median of the fixes around each, as far as there are any; a climb stays what it is.
    """
    if len(t) < 2:
        return height
    step = max(float(np.median(np.diff(t))), 1e-3)
    half = math.ceil(0.5 * STILL_S / step)
    if len(t) <= 2 * half:
        return np.full(len(t), float(np.median(height)))
    around = np.lib.stride_tricks.sliding_window_view(height, 2 * half + 1)
    begin = [np.median(height[: half + 1 + k]) for k in range(half)]
    end = [np.median(height[len(t) - half - 1 - k :]) for k in reversed(range(half))]
    out: Array = np.concatenate([begin, np.median(around, axis=1), end])
    return out


def _ground(t: Array, height: Array, stands: list[tuple[int, int]], apart_m: float) -> Array:
    """(n,) height of the ground, m, from stand to stand; the lowest height where there is none."""
    lowest = float(np.min(height))
    levels = [(0.5 * (t[i] + t[j - 1]), float(np.median(height[i:j]))) for i, j in stands]
    near = [(at, level) for at, level in levels if level < lowest + apart_m]
    if not near:
        return np.full(len(t), lowest)
    times, grounds = zip(*near, strict=True)
    out: Array = np.interp(t, times, grounds)
    return out


def _climb(t: Array, height: Array) -> Array:
    """(n,) m/s, from the height a second before and after: a climb on the spot is no standing."""
    before, after = np.maximum(t - STILL_S, t[0]), np.minimum(t + STILL_S, t[-1])
    rise = np.interp(after, t, height) - np.interp(before, t, height)
    out: Array = rise / np.maximum(after - before, 1e-3)
    return out


def scatter_near(t: Array, times: Array, x: Array) -> Array:
    """(n,) root of the variance of a vector within half a second of ``t`` (n,).

    Args:
        t: (n,) s.
        times: (m,) s, of the vector.
        x: (m, d) it; where there is none the variance is zero.
    """
    order = np.argsort(times, kind="stable")
    times, x = times[order], x[order] - np.mean(x, axis=0)
    begin = np.searchsorted(times, t - 0.5 * STILL_S)
    end = np.searchsorted(times, t + 0.5 * STILL_S)
    count = np.maximum(end - begin, 1)[:, None]

    def mean(of: Array) -> Array:
        summed = np.concatenate([np.zeros((1, of.shape[1])), np.cumsum(of, axis=0)])
        out: Array = (summed[end] - summed[begin]) / count
        return out

    variance = np.sum(mean(x * x) - mean(x) ** 2, axis=1)
    out: Array = np.sqrt(np.maximum(variance, 0.0))
    return out


def _lasting(t: Array, flags: Mask) -> list[tuple[int, int]]:
    """Those runs that are long enough to tell a stand from a moment without speed."""
    return [(i, j) for i, j in _runs(flags) if t[j - 1] - t[i] >= STILL_S]


def _runs(flags: Mask) -> list[tuple[int, int]]:
    """First and last (excluded) of those in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
