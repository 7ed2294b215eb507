"""What passes through samples, at the times asked for: cubics, straight lines, followers."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part


@compiled("void(f8[::1], f8[:,::1], f8[:,:,::1])")
def cubics(t: Array, x: Array, out: Array) -> None:
    """Powers of the share of each interval, into (n - 1, 4, d): three-point slopes."""
    n, d = x.shape
    slope = np.empty((n, d))
    for i in range(1, n - 1):
        a, b = t[i] - t[i - 1], t[i + 1] - t[i]
        before, now, after = -b / (a * (a + b)), (b - a) / (a * b), a / (b * (a + b))
        for c in range(d):
            slope[i, c] = before * x[i - 1, c] + now * x[i, c] + after * x[i + 1, c]
    if n > 2:
        a, b = t[1] - t[0], t[2] - t[1]
        p, q = t[n - 2] - t[n - 3], t[n - 1] - t[n - 2]
        for c in range(d):
            slope[0, c] = (
                -(2.0 * a + b) / (a * (a + b)) * x[0, c]
                + (a + b) / (a * b) * x[1, c]
                - a / (b * (a + b)) * x[2, c]
            )
            slope[n - 1, c] = (
                q / (p * (p + q)) * x[n - 3, c]
                - (q + p) / (p * q) * x[n - 2, c]
                + (2.0 * q + p) / (q * (p + q)) * x[n - 1, c]
            )
    else:
        for c in range(d):
            slope[0, c] = slope[1, c] = (x[1, c] - x[0, c]) / (t[1] - t[0])
    for i in range(n - 1):
        h = t[i + 1] - t[i]
        for c in range(d):
            start, end, rise = h * slope[i, c], h * slope[i + 1, c], x[i + 1, c] - x[i, c]
            out[i, 0, c] = x[i, c]
            out[i, 1, c] = start
            out[i, 2, c] = 3.0 * rise - 2.0 * start - end
            out[i, 3, c] = start + end - 2.0 * rise


@part
def place(t: Array, at: float, near: int) -> int:
    """The interval (0 to n - 2) that a time is in, from one that is near: times come in order."""
    i, last = near, len(t) - 2
    while i < last and t[i + 1] <= at:
        i += 1
    while i > 0 and t[i] > at:
        i -= 1
    return i


@compiled("void(f8[::1], f8[:,:,::1], f8[::1], f8[:,::1])")
def values(t: Array, powers: Array, at: Array, out: Array) -> None:
    """What :func:`cubics` are at times ``at`` (m,), into (m, d); end cubics go on."""
    d, i = powers.shape[2], 0
    for k in range(len(at)):
        i = place(t, at[k], i)
        u = (at[k] - t[i]) / (t[i + 1] - t[i])
        for c in range(d):
            out[k, c] = (
                (powers[i, 3, c] * u + powers[i, 2, c]) * u + powers[i, 1, c]
            ) * u + powers[i, 0, c]


@compiled(
    "void(f8[::1], f8[:,:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1],"
    " f8[:,::1])"
)
def signals(
    t: Array,
    powers: Array,
    at: Array,
    bias: Array,
    six: Array,
    R_bs: Array,
    w_b: Array,
    raw_s: Array,
    f_b: Array,
) -> None:
    """What :func:`cubics` of rate and raw force are at times ``at`` (m,), and what that is felt as.

    Args:
        t: (n,) of the samples, s.
        powers: (n - 1, 4, 6).
        at: (m,) s.
        bias: (3,) taken off the rates, rad/s.
        six: (6,) scale and beta.
        R_bs: (3, 3) board orientation.
        w_b: (m, 3) written to.
        raw_s: (m, 3) written to.
        f_b: (m, 3) written to.
    """
    i, x, f = 0, np.empty(6), np.empty(3)
    for k in range(len(at)):
        i = place(t, at[k], i)
        u = (at[k] - t[i]) / (t[i + 1] - t[i])
        for c in range(6):
            x[c] = ((powers[i, 3, c] * u + powers[i, 2, c]) * u + powers[i, 1, c]) * u + powers[
                i, 0, c
            ]
        for c in range(3):
            w_b[k, c] = x[c] - bias[c]
            raw_s[k, c] = x[3 + c]
            f[c] = x[3 + c] * six[c] + six[3 + c]
        for c in range(3):
            f_b[k, c] = R_bs[c, 0] * f[0] + R_bs[c, 1] * f[1] + R_bs[c, 2] * f[2]


@compiled("void(f8[::1], f8[:,::1], f8[::1], f8[:,::1])")
def straight(t: Array, x: Array, at: Array, out: Array) -> None:
    """Straight lines between samples ``x`` (n, d), n >= 2, at times ``at`` (m,), ends held."""
    i = 0
    for k in range(len(at)):
        i = place(t, at[k], i)
        share = min(max((at[k] - t[i]) / (t[i + 1] - t[i]), 0.0), 1.0)
        for c in range(x.shape[1]):
            out[k, c] = x[i, c] + share * (x[i + 1, c] - x[i, c])


@compiled("void(f8[::1], f8[::1], f8[::1], f8[:,::1])")
def dragged(load: Array, start: Array, plays: Array, out: Array) -> None:
    """Followers that a load (n,) drags along once it is a play away, into (n, plays)."""
    for j in range(len(plays)):
        place, play = start[j], plays[j]
        for i in range(len(load)):
            place = min(max(place, load[i] - play), load[i] + play)
            out[i, j] = place
