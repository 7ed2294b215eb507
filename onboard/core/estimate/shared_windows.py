"""Windows of flight that two accelerometers of one vehicle share: what each felt on average.

Two accelerometers at places ``r_a`` and ``r_b`` of one rigid body feel

    f_a - f_b = W (r_a - r_b),    W e = w x (w x e) + dw/dt x e

whatever the trajectory is.  Means over about a second leave nothing of what the streams do to
vibration, and the mean of ``dw/dt`` over a window is a difference of two rates.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.estimate.limits import APART_S, FEWEST_IN_WINDOW, SHARED_WINDOW_S
from onboard.core.inputs.segments import Batch, Segment
from onboard.core.maths.arrays import Array, Mask


@dataclass(frozen=True, slots=True)
class SharedWindows:
    """Means over windows that two accelerometers, a and b, have in common; sensor axes.

    Attributes:
        t: (n,) when each begins, s.
        raw_a: (n, 3) mean raw sample of a, m/s^2.
        raw_b: (n, 3) the same of b.
        lever: (n, 3) how much more force a feels by its configured place than b does, m/s^2.
        swing: (n, 3, 3) the same for each metre (body axes) by which a is further from b, 1/s^2.
    """

    t: Array
    raw_a: Array
    raw_b: Array
    lever: Array
    swing: Array

    def __len__(self) -> int:
        return len(self.t)

    def where(self, chosen: Mask) -> SharedWindows:
        """Those of the windows that are chosen, ``chosen`` being (n,)."""
        cut = (x[chosen] for x in (self.t, self.raw_a, self.raw_b, self.lever, self.swing))
        return SharedWindows(*cut)


def shared_windows(a: Sequence[Batch], b: Sequence[Batch]) -> SharedWindows:
    """What the flight of two accelerometers has in common, in windows of about a second.

    Args:
        a: batches of one accelerometer, as its engine keeps them.
        b: of the other one.
    """
    parts = list(_parts(a, b))
    if not parts:
        none = np.zeros((0, 3))
        return SharedWindows(np.zeros(0), none, none, none, np.zeros((0, 3, 3)))
    columns = zip(*parts, strict=True)
    return SharedWindows(*(np.concatenate(column) for column in columns))


def one_after_another(flights: Sequence[SharedWindows]) -> SharedWindows:
    """Windows of several flights (at least one), each flight a little after the one before."""
    shifted, last = [], 0.0
    for windows in flights:
        if len(windows):
            t = windows.t - windows.t[0] + last
            shifted.append(replace(windows, t=t))
            last = float(t[-1]) + APART_S
    if len(shifted) < 2:
        return next((w for w in flights if len(w)), flights[0])
    columns = zip(*((w.t, w.raw_a, w.raw_b, w.lever, w.swing) for w in shifted), strict=True)
    return SharedWindows(*(np.concatenate(column) for column in columns))


def _parts(
    a: Sequence[Batch], b: Sequence[Batch]
) -> Iterator[tuple[Array, Array, Array, Array, Array]]:
    begins = np.array([other.fixes.t[0] for other in b])
    ends = np.array([other.fixes.t[-1] for other in b])
    for one in a:
        start, end = float(one.fixes.t[0]), float(one.fixes.t[-1])
        for i in np.flatnonzero((begins < end) & (ends > start)):
            first, second = one.segment, b[int(i)].segment
            low = max(start, begins[i], first.t[0], second.t[0])
            high = min(end, ends[i], first.t[-1], second.t[-1])
            count = int((high - low) / SHARED_WINDOW_S)
            if count > 0:
                yield _over(np.linspace(low, high, count + 1), first, second)


def _over(edges: Array, a: Segment, b: Segment) -> tuple[Array, Array, Array, Array, Array]:
    swing = a.R_bs.T @ _swing(a.t, a.w_b, edges)
    # From a to the antenna less from b to it: where b is, seen from a.
    lever = swing @ (b.lever_arm_b - a.lever_arm_b)
    raw_a, raw_b = window_means(a.t, a.raw_s, edges), window_means(b.t, b.raw_s, edges)
    well = np.isfinite(raw_a + raw_b + lever).all(axis=1)
    for segment in (a, b):
        well &= np.diff(np.searchsorted(segment.t, edges)) >= FEWEST_IN_WINDOW
    return edges[:-1][well], raw_a[well], raw_b[well], lever[well], swing[well]


def _swing(t: Array, w_b: Array, edges: Array) -> Array:
    """(n, 3, 3) means of the matrix ``W`` over windows, body axes, 1/s^2."""
    products = window_means(t, (w_b[:, :, None] * w_b[:, None, :]).reshape(-1, 9), edges)
    W = products.reshape(-1, 3, 3)
    W = W - np.trace(W, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    at = np.stack([np.interp(edges, t, w_b[:, j]) for j in range(3)], axis=-1)
    rate = np.diff(at, axis=0) / np.diff(edges)[:, None]
    x, y, z = rate.T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
    out: Array = W + cross
    return out


def window_means(t: Array, x: Array, edges: Array) -> Array:
    """Means of straight lines between samples, over neighbouring windows.

    Args:
        t: (n,) times of samples, s, increasing.
        x: (n, k) samples.
        edges: (m + 1,) where windows begin and end, inside ``t``.

    Returns:
        (m, k) means.
    """
    h = np.diff(t)[:, None]
    whole = np.vstack([np.zeros(x.shape[1]), np.cumsum(0.5 * h * (x[1:] + x[:-1]), axis=0)])
    i = np.clip(np.searchsorted(t, edges, side="right") - 1, 0, len(t) - 2)
    past = (edges - t[i])[:, None]
    slope = (x[i + 1] - x[i]) / h[i]
    integral = whole[i] + past * (x[i] + 0.5 * past * slope)
    out: Array = np.diff(integral, axis=0) / np.diff(edges)[:, None]
    return out
