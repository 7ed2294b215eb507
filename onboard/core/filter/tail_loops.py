"""What is in the tail of its distribution, as loops that numba compiles.

:func:`onboard.core.filter.innovation_gates.tails`, and what
:class:`~onboard.core.filter.whitening.WhiteningFilter` makes of them where no gate refuses
anything, equal to both to rounding.
"""

from __future__ import annotations

import numpy as np

from onboard.core.filter.limits import ANEW, GATE_HEIGHT, GATE_VELOCITY
from onboard.core.filter.readings import Index
from onboard.core.filter.state import ERRORS, RATE
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiler import part

NOTHING, SOMETHING, UNTOLD = 0, 1, 2
"""What is in a tail; of what is untold, a gate may have something to say."""
BY_COVARIANCE, BY_INFORMATION = 0, 1
"""How well the estimate is known: a matrix is its covariance, or its information."""
_TILT, _HEADING = ANEW["t"], ANEW["y"]


@part
def counts_of(offered: Index) -> tuple[int, int, int, int]:
    """How many numbers an epoch has of each kind: velocity, height, tilt, heading."""
    return offered[0], offered[1], 2 * offered[2], offered[2]


@part
def _along_known(h: Array, known: Array, S: Array) -> None:
    """Add ``h C h^T`` to S (n, n), of regressors (n, m) and the covariance (m, m)."""
    n, m = h.shape
    row = np.empty(m)
    for a in range(n):
        row[:] = 0.0
        for i in range(m):
            x, from_ = h[a, i], known[i]
            for j in range(m):
                row[j] += x * from_[j]
        for d in range(n):
            x = 0.0
            for j in range(m):
                x += row[j] * h[d, j]
            S[a, d] += x


@part
def _along_informed(h: Array, informed: Array, S: Array) -> None:
    """Add ``h I^-1 h^T`` to S (n, n), of regressors (n, m) and the information (m, m).

    Gauss's elimination of a positive matrix, whose halves are alike, with ``h`` below it.
    """
    n, m = h.shape
    A, D = informed.copy(), h.copy()
    for k in range(m):
        of, per = A[k], 1.0 / A[k, k]
        for i in range(k + 1, m):
            f, row = of[i] * per, A[i]
            for j in range(i, m):
                row[j] -= f * of[j]
        for a in range(n):
            f, row = D[a, k] * per, D[a]
            for d in range(n):
                S[a, d] += f * D[d, k]
        for a in range(n):
            f, row = D[a, k] * per, D[a]
            for j in range(k + 1, m):
                row[j] -= f * of[j]


@part
def _nis(r: Array, S: Array) -> float:
    """``r^T S^-1 r`` of up to three numbers; S is written over."""
    nis = 0.0
    for k in range(len(r)):
        nis += r[k] * r[k] / S[k, k]
        for i in range(k + 1, len(r)):
            f = S[i, k] / S[k, k]
            r[i] -= f * r[k]
            for j in range(k + 1, len(r)):
                S[i, j] -= f * S[k, j]
    return nis


@part
def tails_of(
    W: Array,
    theta: Array,
    offered: Index,
    tails: Array,
    known: Array,
    form: int,
    factor: Array,
) -> int:
    """What of an epoch is in the tail of its distribution.

    Args:
        W: (B, r, C) whitened innovations.
        theta: (m,) estimate.
        offered: (4,) as of :func:`onboard.core.filter.runs.run`.
        tails: (4,) by degrees of freedom.
        known: (m, m) how well the estimate is known.
        form: which matrix that is, :data:`BY_COVARIANCE` or another.
        factor: (4,) by how much the variance of each kind is larger; written to.

    Returns:
        :data:`NOTHING`, :data:`SOMETHING`, or :data:`UNTOLD`.
    """
    m, at, found = len(theta), 0, NOTHING
    counts = counts_of(offered)
    r = np.empty(3)
    for kind in range(4):
        n, nis = counts[kind], 0.0
        factor[kind] = 1.0
        for a in range(n):
            x = W[0, at + a, 0]
            for c in range(m):
                x -= W[0, at + a, c + 1] * theta[c]
            r[a] = x
            nis += x * x
        if n > 0 and not nis <= tails[n]:
            judged = kind == 1 or (kind == 0 and offered[3] == 0)
            limit = GATE_VELOCITY if kind == 0 else GATE_HEIGHT
            if not nis < np.inf or (judged and nis > limit):
                return UNTOLD
            S, h = np.eye(n), W[0, at : at + n, 1 : m + 1]
            if form == BY_COVARIANCE:
                _along_known(h, known, S)
            else:
                _along_informed(h, known, S)
            nis = _nis(r[:n], S)
            if nis > tails[n]:
                factor[kind] = nis / tails[n]
                found = SOMETHING
        at += n
    if factor[2] > _TILT or factor[3] > _HEADING:
        return UNTOLD  # set anew, and that is noted
    return found


@part
def widen(
    carried: Array,
    m1: int,
    offered: Index,
    factor: Array,
    log_var: Array,
    since: float,
    reads: Array,
) -> None:
    """More noise for what is in a tail: of its own, or a move of the recorded attitude.

    Args:
        carried: (B, STATES, C).
        m1: columns of the mean.
        offered: (4,) as of :func:`onboard.core.filter.runs.run`.
        factor: (4,) of :func:`tails_of`.
        log_var: (B, r) of the innovations before they are whitened.
        since: s since something was taken.
        reads: (B, MEASURED) variances of the white noise of each number.
    """
    v, h = offered[0], offered[1]
    for b in range(len(carried)):
        P = carried[b, :, m1:]
        for i in range(v):
            reads[b, i] *= factor[0]
        reads[b, 3] *= factor[1]
        for j in range(3):
            by = factor[2] if j < 2 else factor[3]
            if by > 1.0:
                more = (by - 1.0) * np.exp(log_var[0, v + h + j])
                P[ERRORS + 4 + j, ERRORS + 4 + j] += more
                if j == 2:
                    P[RATE, RATE] += more / (since * since)
