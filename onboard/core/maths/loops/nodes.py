"""Signals at nodes and how the attitude turns from one to the next, in one go."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array, Vector3
from onboard.core.maths.compiler import compiled, part
from onboard.core.maths.loops.curves import place
from onboard.core.maths.loops.turns import turn_between, turn_by, turned


@part
def _rate(powers: Array, i: int, u: float, bias: Vector3) -> Vector3:
    """Rate less its bias, a share ``u`` into interval i."""
    a, b, c, d = powers[i, 0], powers[i, 1], powers[i, 2], powers[i, 3]
    return (
        ((d[0] * u + c[0]) * u + b[0]) * u + a[0] - bias[0],
        ((d[1] * u + c[1]) * u + b[1]) * u + a[1] - bias[1],
        ((d[2] * u + c[2]) * u + b[2]) * u + a[2] - bias[2],
    )


@part
def _raw(powers: Array, i: int, u: float) -> Vector3:
    """Raw force, a share ``u`` into interval i."""
    a, b, c, d = powers[i, 0], powers[i, 1], powers[i, 2], powers[i, 3]
    return (
        ((d[3] * u + c[3]) * u + b[3]) * u + a[3],
        ((d[4] * u + c[4]) * u + b[4]) * u + a[4],
        ((d[5] * u + c[5]) * u + b[5]) * u + a[5],
    )


@part
def _felt(raw: Vector3, six: Array, R_bs: Array) -> Vector3:
    """Force in body axes by scale and beta."""
    x, y, z = raw[0] * six[0] + six[3], raw[1] * six[1] + six[4], raw[2] * six[2] + six[5]
    return (
        R_bs[0, 0] * x + R_bs[0, 1] * y + R_bs[0, 2] * z,
        R_bs[1, 0] * x + R_bs[1, 1] * y + R_bs[1, 2] * z,
        R_bs[2, 0] * x + R_bs[2, 1] * y + R_bs[2, 2] * z,
    )


@part
def _share(t: Array, at: float, i: int) -> float:
    """How far into interval i a time is."""
    return float((at - t[i]) / (t[i + 1] - t[i]))


@part
def _begin(R: Array) -> None:
    """The identity into (3, 3)."""
    for r in range(3):
        for c in range(3):
            R[r, c] = 1.0 if r == c else 0.0


@compiled(
    "void(f8[::1], f8[:,:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,:,::1],"
    " f8[:,:,::1], f8[:,:,::1], f8[:,:,:,::1])"
)
def inside(
    t: Array,
    powers: Array,
    at: Array,
    step: Array,
    bias: Array,
    six: Array,
    R_bs: Array,
    w_b: Array,
    raw_s: Array,
    f_b: Array,
    P: Array,
) -> None:
    """Signals at M + 1 even nodes in each of K intervals, and turns in a row.

    Args:
        t: (n,) of the samples, s.
        powers: (n - 1, 4, 6) cubics of rate and raw force.
        at: (K, M + 1) s.
        step: (K,) from node to node, s.
        bias: (3,) taken off the rates, rad/s.
        six: (6,) scale and beta.
        R_bs: (3, 3) board orientation.
        w_b: (K, M + 1, 3) written to.
        raw_s: (K, M + 1, 3) written to.
        f_b: (K, M + 1, 3) written to.
        P: (K, M + 1, 3, 3) body axes at the node to those at the interval's first; written to.
    """
    K, M1 = at.shape
    b = bias[0], bias[1], bias[2]
    i = 0
    for k in range(K):
        before = (0.0, 0.0, 0.0)
        for m in range(M1):
            i = place(t, at[k, m] - 0.5 * step[k], i)
            middle = _rate(powers, i, _share(t, at[k, m] - 0.5 * step[k], i), b)
            i = place(t, at[k, m], i)
            u = _share(t, at[k, m], i)
            w, raw = _rate(powers, i, u, b), _raw(powers, i, u)
            f = _felt(raw, six, R_bs)
            for c in range(3):
                w_b[k, m, c], raw_s[k, m, c], f_b[k, m, c] = w[c], raw[c], f[c]
            if m == 0:
                _begin(P[k, 0])
            else:
                turned(P[k, m - 1], turn_between(before, middle, w, step[k]), P[k, m])
            before = w


@compiled(
    "void(f8[::1], f8[:,:,::1], f8, f8, f8[::1], f8[::1], f8[:,::1], f8[::1], f8[:,:,::1],"
    " f8[:,::1], f8[:,::1])"
)
def followed(
    t: Array,
    powers: Array,
    start: float,
    step: float,
    bias: Array,
    six: Array,
    R_bs: Array,
    lever: Array,
    R: Array,
    force: Array,
    there: Array,
) -> None:
    """Attitude and force at n even nodes, in the axes of the first.

    Args:
        t: (n,) of the samples, s, and powers, bias, six and R_bs as of :func:`inside`.
        powers: see there.
        start: time of the first node, s.
        step: s.
        bias: see there.
        six: see there.
        R_bs: see there.
        lever: (3,) an arm, body axes, m.
        R: (n, 3, 3) body axes at the node to those at the first; written to.
        force: (n, 3) written to.
        there: (n, 3) that at the end of the arm, by second differences; written to.
    """
    b = bias[0], bias[1], bias[2]
    n, i, last = len(R), 0, len(R) - 1
    arm, before = np.empty((n, 3)), (0.0, 0.0, 0.0)
    for k in range(n):
        at = start + k * step
        i = place(t, at - 0.5 * step, i)
        middle = _rate(powers, i, _share(t, at - 0.5 * step, i), b)
        i = place(t, at, i)
        u = _share(t, at, i)
        w = _rate(powers, i, u, b)
        f = _felt(_raw(powers, i, u), six, R_bs)
        if k == 0:
            _begin(R[0])
        else:
            turned(R[k - 1], turn_between(before, middle, w, step), R[k])
        before = w
        for c in range(3):
            force[k, c] = R[k, c, 0] * f[0] + R[k, c, 1] * f[1] + R[k, c, 2] * f[2]
            arm[k, c] = R[k, c, 0] * lever[0] + R[k, c, 1] * lever[1] + R[k, c, 2] * lever[2]
    per_square = 1.0 / (step * step)
    for k in range(n):
        j = min(max(k, 1), last - 1)
        for c in range(3):
            swung = (arm[j + 1, c] - 2.0 * arm[j, c] + arm[j - 1, c]) * per_square
            there[k, c] = force[k, c] + swung


@compiled("void(f8[::1], f8[:,:,::1], f8, f8, f8[::1], f8[:,:,::1], f8[::1], f8[:,:,::1])")
def turned_on(
    t: Array,
    powers: Array,
    start: float,
    step: float,
    bias: Array,
    R: Array,
    at: Array,
    out: Array,
) -> None:
    """Attitudes at times ``at`` (k,) from those of even nodes, R (n, 3, 3), into (k, 3, 3).

    From the node before at the rate half-way; the rest is as of :func:`followed`.
    """
    b, i = (bias[0], bias[1], bias[2]), 0
    for k in range(len(at)):
        j = int((at[k] - start) / step)
        node = start + j * step
        half_way, h = 0.5 * (at[k] + node), at[k] - node
        i = place(t, half_way, i)
        w = _rate(powers, i, _share(t, half_way, i), b)
        turned(R[j], turn_by(w[0] * h, w[1] * h, w[2] * h), out[k])
