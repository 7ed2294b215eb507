"""The filter's arithmetic as loops that numba compiles.

Equal to that of :mod:`onboard.core.filter.kernel` to rounding (no fast-math), without what numpy's
calls cost, and with what is known of the matrices: most of a transition is zero or one, and a
covariance is symmetric.  Rows of a state are 0 to 2 velocity, 3 height, 4 to 6 attitude, 7 to 9
bias, 10 to 16 the slow errors, 17 the rate of the last (:mod:`onboard.core.filter.state`).

Compiled code is kept on disk (:mod:`onboard.core.maths.compiler`).
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.readings import Index
from onboard.core.filter.state import ERRORS, HEADING, MEASURED, RATE, STATES
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import compiled, part


@part
def _transition(duration: float, R_nb: Array, moved: Array, F: Array) -> None:
    """Into ``F`` (MEASURED, ERRORS), which is zero."""
    n = np.zeros((3, 8))
    for i in range(3):
        for k in range(3):
            for j in range(8):
                n[i, j] += R_nb[i, k] * moved[k, j]
    for i in range(MEASURED):
        F[i, i] = 1.0
    F[0, 5], F[0, 6], F[1, 4] = n[2, 0], -n[1, 0], -n[2, 0]
    F[1, 6], F[2, 4], F[2, 5] = n[0, 0], n[1, 0], -n[0, 0]
    F[3, 2], F[3, 4], F[3, 5] = -duration, -n[1, 1], n[0, 1]
    for i in range(3):
        for j in range(3):
            F[i, MEASURED + j] = n[i, 5 + j]
            F[4 + i, MEASURED + j] = -n[i, 2 + j]


@part
def _drive(R_nb: Array, stack: Array, carried: Array) -> None:
    """Add a stack in body axes to the first states."""
    for i in range(MEASURED):
        axis, first = (i, 0) if i < 3 else (2, 3) if i == 3 else (i - 4, 6)
        a, b, d = R_nb[axis, 0], R_nb[axis, 1], R_nb[axis, 2]
        for c in range(stack.shape[1]):
            x = carried[i, c] + a * stack[first, c] + b * stack[first + 1, c]
            carried[i, c] = x + d * stack[first + 2, c]


@part
def _spread(R_nb: Array, var: Array, first: int, P: Array) -> None:
    """Add three variances along body axes, from ``first`` on, to a covariance in NED."""
    for k in range(3):
        x = var[first + k]
        if x > 0.0:
            for i in range(3):
                for j in range(3):
                    P[i, j] += x * R_nb[i, k] * R_nb[j, k]


@compiled("void(f8[:,:], f8[:,::1], f8[::1], f8, f8[::1], f8[:,::1])")
def measured(
    R_nb: Array, stack: Array, along: Array, v_down: float, turned: Array, z: Array
) -> None:
    """What an epoch measures, into ``z`` (MEASURED, m + 1), which holds its part in NED."""
    _drive(R_nb, stack, z)
    row = z[3]
    for c in range(len(along)):
        row[c + 1] -= v_down * along[c]
    for i in range(3):
        z[4 + i, 0] += turned[i]


@part
def _add(row: Array, a: float, x: Array, b: float, y: Array, c: float, z: Array) -> None:
    """``row += a x + b y + c z``, in this order: one way through memory in the place of three."""
    for i in range(len(row)):
        row[i] = row[i] + a * x[i] + b * y[i] + c * z[i]


@part
def _from_the_left(F: Array, C: Array) -> None:
    """``F C`` in place: rows of the states that are driven by others, by what is not zero in F."""
    _add(C[3], F[3, 2], C[2], F[3, 4], C[4], F[3, 5], C[5])  # the velocity of before
    x, y, z = C[7], C[8], C[9]
    for i in range(3):
        j, k = (5, 6) if i == 0 else (4, 6) if i == 1 else (4, 5)
        row, one, two = C[i], C[j], C[k]
        a, b, d, e, f = F[i, j], F[i, k], F[i, 7], F[i, 8], F[i, 9]
        for c in range(len(row)):
            row[c] = row[c] + a * one[c] + b * two[c] + d * x[c] + e * y[c] + f * z[c]
    for i in range(4, 7):
        _add(C[i], F[i, 7], x, F[i, 8], y, F[i, 9], z)


@part
def _slow(decay: Array, swing: Array, C: Array) -> None:
    """Slow errors decay in place, each for itself; that of the heading with its rate."""
    for i in range(MEASURED - 1):
        row, kept = C[ERRORS + i], decay[i]
        for c in range(len(row)):
            row[c] *= kept
    angle, rate = C[HEADING], C[RATE]
    stays, added, back, goes = decay[MEASURED - 1], swing[0], swing[1], swing[2]
    for c in range(len(angle)):
        x, u = angle[c], rate[c]
        angle[c] = stays * x + added * u
        rate[c] = back * x + goes * u


@part
def _from_the_right(F: Array, decay: Array, swing: Array, C: Array, at: int) -> None:
    """``P F^T`` in place, of the covariance that begins at column ``at``.

    Of all rows, though half of a symmetric matrix says it all: what is mirrored is symmetric to the
    last digit, the rest is not, and where angles are read to a tenth of a milliradian the rounding
    errors of the noise in the regressors then grow twofold with each step.
    """
    a, b, c, d, e = F[0, 5], F[0, 6], F[0, 7], F[0, 8], F[0, 9]
    f, g, h, i, j = F[1, 4], F[1, 6], F[1, 7], F[1, 8], F[1, 9]
    k, l, m, n, o = F[2, 4], F[2, 5], F[2, 7], F[2, 8], F[2, 9]  # noqa: E741 - in a row
    for s in range(STATES):
        row = C[s, at : at + STATES]
        error, rate = row[HEADING], row[RATE]
        for q in range(MEASURED):
            row[ERRORS + q] *= decay[q]
        row[HEADING] += swing[0] * rate
        row[RATE] = swing[1] * error + swing[2] * rate
        row[3] = row[3] + F[3, 2] * row[2] + F[3, 4] * row[4] + F[3, 5] * row[5]
        u, v, w = row[4], row[5], row[6]
        x, y, z = row[7], row[8], row[9]
        row[0] = row[0] + a * v + b * w + c * x + d * y + e * z
        row[1] = row[1] + f * u + g * w + h * x + i * y + j * z
        row[2] = row[2] + k * u + l * v + m * x + n * y + o * z
        row[4] = u + F[4, 7] * x + F[4, 8] * y + F[4, 9] * z
        row[5] = v + F[5, 7] * x + F[5, 8] * y + F[5, 9] * z
        row[6] = w + F[6, 7] * x + F[6, 8] * y + F[6, 9] * z


@compiled(
    "void(f8[:,:,::1], f8[:,:], f8, f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1],"
    " f8[:,::1], f8[:,::1])"
)
def predict(
    carried: Array,
    R_nb: Array,
    duration: float,
    moved: Array,
    stack: Array,
    missed: Array,
    fall: Array,
    decay: Array,
    swing: Array,
    before: Array,
    after: Array,
) -> None:
    """Carry (B, STATES, C) through one step, in place: F, then process noise and what drives it."""
    members, _, columns = carried.shape
    m1 = stack.shape[1]
    count = (columns - m1) // STATES
    F, driven = np.zeros((MEASURED, ERRORS)), np.zeros((MEASURED, m1))
    _transition(duration, R_nb, moved, F)
    _drive(R_nb, stack, driven)
    for i in range(MEASURED):
        driven[i, 0] += fall[i]
    for b in range(members):
        C = carried[b]
        _spread(R_nb, before[b], 0, C[0:3, m1 : m1 + 3])
        for i in range(3, STATES):
            C[i, m1 + i] += before[b, i]
        _from_the_left(F, C)
        _slow(decay[b], swing[b], C)
        for at in range(m1, m1 + count * STATES, STATES):
            _from_the_right(F, decay[b], swing[b], C, at)
        _spread(R_nb, after[b], 0, C[0:3, m1 : m1 + 3])
        for i in range(3, STATES):
            C[i, m1 + i] += after[b, i]
        _spread(R_nb, missed, 0, C[0:3, m1 : m1 + 3])
        _spread(R_nb, missed, 3, C[4:7, m1 + 4 : m1 + 7])
        for i in range(MEASURED):
            row, more = C[i], driven[i]
            for c in range(m1):
                row[c] += more[c]
    # What the walk along each body axis makes, where it is carried.
    for axis in range(count - 1):
        at, walk = m1 + (axis + 1) * STATES, before[0, axis] + after[0, axis]
        for i in range(3):
            for j in range(3):
                carried[0, i, at + j] += walk * R_nb[i, axis] * R_nb[j, axis]


@compiled(
    "i8(f8[:,:,::1], f8[:,::1], i8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1])"
)
def whiten(
    carried: Array,
    z: Array,
    number: Index,
    noise: Array,
    E: Array,
    W: Array,
    whitener: Array,
    log_var: Array,
) -> int:
    """Innovations of the numbers ``number`` into as many rows of E, W, whitener and log_var.

    Returns:
        0, or the first (from 1) whose covariance is not positive.
    """
    m1, r, columns = z.shape[1], len(number), carried.shape[2]
    L = np.empty((r, r))
    for b in range(len(carried)):
        for a in range(r):
            i = number[a]
            row, one, two = W[b, a], carried[b, i], carried[b, i + ERRORS]
            for c in range(columns):
                row[c] = -(one[c] + two[c])
            for c in range(m1):
                row[c] += z[i, c]
            if b == 0:
                E[a] = row[:m1]
        for a in range(r):
            for d in range(a + 1):
                j = m1 + number[d]
                x = -(W[b, a, j] + W[b, a, j + ERRORS])
                if d == a:
                    x += noise[b, number[a]]
                for k in range(d):
                    x -= L[a, k] * L[d, k]
                if d < a:
                    L[a, d] = x / L[d, d]
                elif x <= 0.0:
                    return a + 1
                else:
                    L[a, a] = np.sqrt(x)
                    log_var[b, a] = np.log(x)
        for a in range(r):
            row = W[b, a]
            for k in range(a):
                f, from_ = L[a, k], W[b, k]
                for c in range(columns):
                    row[c] -= f * from_[c]
            f = 1.0 / L[a, a]
            for c in range(columns):
                row[c] *= f
        if b == 0:
            for d in range(r):
                for a in range(d, r):
                    x = 1.0 if a == d else 0.0
                    for k in range(d, a):
                        x -= L[a, k] * whitener[k, d]
                    whitener[a, d] = x / L[a, a]
    return 0


@part
def _less_four(row: Array, gain: Array, W: Array, first: int) -> None:
    """``row -= gain W`` of four innovations from ``first`` on: one way through memory for four."""
    a, b, c, d = gain[first], gain[first + 1], gain[first + 2], gain[first + 3]
    w, x, y, z = W[first], W[first + 1], W[first + 2], W[first + 3]
    for i in range(len(row)):
        row[i] = row[i] - a * w[i] - b * x[i] - c * y[i] - d * z[i]


@part
def _less_seven(C: Array, first: int, width: int, G: Array, at: int, W: Array) -> None:
    """Columns of C less the transpose of ``G[:, at:]`` times the seven rows of W (7, width).

    Two rows in one go through memory take half as long as one by one, and where there are fewer
    innovations, rows of zeros cost less than a loop over those that there are.
    """
    for i in range(0, STATES, 2):
        j = at + i
        a, b, c, d, e, f, g = G[0, j], G[1, j], G[2, j], G[3, j], G[4, j], G[5, j], G[6, j]
        j = at + i + 1
        p, q, r, s, t, u, v = G[0, j], G[1, j], G[2, j], G[3, j], G[4, j], G[5, j], G[6, j]
        one, two = C[i, first : first + width], C[i + 1, first : first + width]
        for k in range(width):
            m, n, o, w, x, y, z = W[0, k], W[1, k], W[2, k], W[3, k], W[4, k], W[5, k], W[6, k]
            one[k] = one[k] - a * m - b * n - c * o - d * w - e * x - f * y - g * z
            two[k] = two[k] - p * m - q * n - r * o - s * w - t * x - u * y - v * z


@compiled("void(f8[:,:,::1], f8[:,:,::1], i8)")
def take(carried: Array, W: Array, m1: int) -> None:
    """Add gain times innovation to all that is carried, in place."""
    members, _, columns = carried.shape
    r = W.shape[1]
    fours = r - r % 4
    for b in range(members):
        if r == MEASURED:
            _less_seven(carried[b], 0, columns, W[b], m1, W[b])
            continue
        for i in range(STATES):
            row, gain = carried[b, i], W[b, :, m1 + i]
            for a in range(0, fours, 4):
                _less_four(row, gain, W[b], a)
            for a in range(fours, r):
                f, from_ = gain[a], W[b, a]
                for c in range(columns):
                    row[c] -= f * from_[c]


@compiled("void(f8[:,::1], f8[:,::1], f8[:,::1], i8[::1], i8, f8[::1])")
def take_noise(C: Array, W: Array, whitener: Array, number: Index, m1: int, gram: Array) -> None:
    """The update from the right of the noise that is carried, in place; its squares to ``gram``."""
    r = len(number)
    K, read = np.zeros((MEASURED, STATES)), np.zeros((MEASURED, STATES))
    for k in range(r):
        for a in range(k, r):
            for i in range(STATES):
                K[k, i] -= whitener[a, k] * W[a, m1 + i]
    for axis in range(3):
        at = m1 + (axis + 1) * STATES
        for a in range(r):
            for d in range(a + 1):
                j = at + number[d]
                gram[axis] -= (W[a, j] + W[a, j + ERRORS]) * whitener[a, d]
        for i in range(STATES):
            row = C[i, at : at + STATES]
            for a in range(r):
                read[a, i] = row[number[a]] + row[number[a] + ERRORS]
        _less_seven(C, at, STATES, read, 0, K)
