"""The disturbance that no model describes: coloured, so that rows must be whitened to be counted.

Per axis a first-order Gauss-Markov process (gusts, errors of the velocity, what is not modelled)
plus white noise (vibration), times a size that may grow with the sensitivity to gusts.  Levels are
chosen by likelihood.  The whitened rows are the innovations of the steady-state Kalman filter
(B. D. O. Anderson and J. B. Moore, *Optimal Filtering*, 1979, chapter 4), which for this process is
a recursion of first order, here solved by doubling so that it needs no loop over time.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.limits import (
    CORRELATION_S,
    FINER_LEVELS,
    GUST_LEVELS,
    LEAST_NOISE_M_S2,
    WHITE_SHARES,
)
from onboard.core.vehicle.recursion import accumulated, starts_of

AT_ONCE = 1 << 16
"""Numbers that noise is tried on in one pass: half a megabyte, which a cache holds [cost]."""


@dataclass(frozen=True, slots=True)
class AxisNoise:
    """Noise of the force along one axis.

    Attributes:
        force: standard deviation that is there always, m/s^2.
        gust: standard deviation of the air's velocity that acts by the sensitivity, m/s.
        correlation_s: of the coloured part, s.
        white: share of white noise in the variance.
    """

    force: float
    gust: float = 0.0
    correlation_s: float = 1.0
    white: float = 1.0

    def size(self, sensitivity: Array) -> Array:
        """(n,) standard deviation, m/s^2; ``sensitivity`` (n,) is m/s^2 per m/s of gust."""
        out: Array = np.sqrt(self.force**2 + (self.gust * sensitivity) ** 2)
        return out


@dataclass(frozen=True, slots=True)
class _Recursion:
    """``e_k = y_k - phi y_(k-1) + decay e_(k-1)``, variance of e over that of y."""

    phi: float
    decay: float
    variance: float

    @property
    def root(self) -> float:
        """Standard deviation of e over that of y."""
        return math.sqrt(self.variance)


def _recursion(step_s: float, correlation_s: float, white: float) -> _Recursion:
    """The steady-state filter of a process of variance one."""
    phi = math.exp(-step_s / correlation_s)
    coloured, r = 1.0 - white, white
    q = coloured * (1.0 - phi * phi)
    # Riccati's equation of the scalar state: P^2 + P (r - phi^2 r - q) - q r = 0.
    half = 0.5 * (r * (1.0 - phi * phi) - q)
    P = -half + math.sqrt(half * half + q * r)
    s = P + r
    gain = P / s if s > 0.0 else 1.0
    return _Recursion(phi, phi * (1.0 - gain), s)


def whitened(
    rows: Array, noise: AxisNoise, sensitivity: Array, piece: NDArray[np.int64], step_s: float
) -> Array:
    """(n, m) rows of unit variance, if the noise is as it says.

    Args:
        rows: (n, m) residual and regressors, m/s^2 (per unit).
        noise: of this axis.
        sensitivity: (n,) m/s^2 per m/s of gust.
        piece: (n,) number of the uninterrupted piece; the recursion begins anew with each.
        step_s: s.
    """
    rec = _recursion(step_s, noise.correlation_s, noise.white)
    scaled = rows / noise.size(sensitivity)[:, None]
    return _innovations(scaled, rec.phi, rec.decay, rec.root, starts_of(piece))


def _innovations(
    scaled: Array, phi: float | Array, decay: float | Array, root: float | Array, starts: Mask
) -> Array:
    """(n, m) innovations over their standard deviation, of rows with a variance of one.

    Numbers of the recursion are those of all columns, or (m,) of each.
    """
    z = scaled.copy()
    z[1:] -= phi * scaled[:-1]
    z[starts] = scaled[starts]
    out: Array = accumulated(z, decay, starts)
    out /= root
    # The first of a piece has nothing before it: it is as large as the process.
    out[starts] = scaled[starts]
    return out


@dataclass(frozen=True, slots=True)
class Onsets:
    """Whitened columns (n, p), and what they are if a column is nothing before a row.

    Begun at row i, the whitened column is ``whole + apart[i] decay^(k - i)`` in the rows k of the
    same piece from i on, and ``whole`` in pieces after it.
    """

    whole: Array
    apart: Array
    decay: float


def onsets(
    rows: Array, noise: AxisNoise, sensitivity: Array, piece: NDArray[np.int64], step_s: float
) -> Onsets:
    """Columns (n, p) whitened as by :func:`whitened`, for a beginning at any of their rows."""
    rec = _recursion(step_s, noise.correlation_s, noise.white)
    whole = whitened(rows, noise, sensitivity, piece, step_s)
    scaled = rows / noise.size(sensitivity)[:, None]
    apart = np.zeros_like(whole)
    apart[1:] = rec.phi * scaled[:-1] / math.sqrt(rec.variance) - rec.decay * whole[:-1]
    apart[starts_of(piece)] = 0.0
    return Onsets(whole, apart, rec.decay)


def fitted_noise(
    residual: Array,
    sensitivity: Array,
    piece: NDArray[np.int64],
    step_s: float,
    *,
    gusts: bool = False,
) -> AxisNoise:
    """The likeliest noise of a residual (n,), m/s^2.

    Args:
        residual: what the model leaves of the force.
        sensitivity: (n,) m/s^2 per m/s of gust.
        piece: (n,) number of the uninterrupted piece.
        step_s: s.
        gusts: whether noise may grow with the sensitivity.
    """
    left = _Left(residual, sensitivity, starts_of(piece), step_s)
    levels = GUST_LEVELS if gusts else (0.0,)
    grid = list(itertools.product(CORRELATION_S, WHITE_SHARES))
    some = max(1, AT_ONCE // (len(levels) * len(residual)))
    batches = (grid[k : k + some] for k in range(0, len(grid), some))
    _, noise = max((trial for its in batches for trial in left.scored(levels, its)), key=_score)
    level = noise.gust * left.mean / noise.force
    if level > 0.0:
        near = (level, *(level * by for by in FINER_LEVELS))
        _, noise = max(left.scored(near, [(noise.correlation_s, noise.white)]), key=_score)
    return noise


def gust_evidence(
    residual: Array, sensitivity: Array, piece: NDArray[np.int64], step_s: float, noise: AxisNoise
) -> tuple[float, float]:
    """Twice the log-likelihood that a gust level adds, and that level, m/s."""
    left = _Left(residual, sensitivity, starts_of(piece), step_s)
    none, *trials = left.scored((0.0, *GUST_LEVELS), [(noise.correlation_s, noise.white)])
    score, trial = max(trials, key=_score)
    return 2.0 * (score - none[0]), trial.gust


def likelihood(
    residual: Array,
    piece: NDArray[np.int64],
    step_s: float,
    noise: AxisNoise,
    sensitivity: Array | None = None,
) -> float:
    """Logarithm of the likelihood of a residual (n,) by a noise of this shape.

    It grows with the ``sensitivity`` (n,) to gusts, m/s^2 per m/s, where that is given.
    """
    even = np.ones(len(residual)) if sensitivity is None else sensitivity
    level = 0.0 if sensitivity is None else noise.gust * (float(np.mean(even)) or 1.0) / noise.force
    left = _Left(residual, even, starts_of(piece), step_s)
    return left.scored((level,), [(noise.correlation_s, noise.white)])[0][0]


@dataclass(frozen=True, slots=True)
class _Left:
    """A residual (n,), m/s^2, its sensitivity (n,) to gusts, where (n,) it begins anew."""

    residual: Array
    sensitivity: Array
    starts: Mask
    step_s: float

    @property
    def mean(self) -> float:
        """The mean sensitivity, 1/s; one where nothing is sensitive."""
        return float(np.mean(self.sensitivity)) or 1.0

    def scored(
        self, levels: Sequence[float], shapes: Sequence[tuple[float, float]]
    ) -> list[tuple[float, AxisNoise]]:
        """Log-likelihoods with the size profiled out, each with the noise of that size.

        Args:
            levels: of gusts that act by the mean sensitivity, over the force that is always there.
            shapes: time of correlation, s, and share of white noise in the variance; with each of
                them every level in turn, all in one pass over the residual.
        """
        n, mean = len(self.residual), self.mean
        sizes = [AxisNoise(1.0, level / mean).size(self.sensitivity) for level in levels]
        spread = np.column_stack(sizes)
        recs = [_recursion(self.step_s, tau, white) for tau, white in shapes]
        of_each = [(rec.phi, rec.decay, rec.root) for rec in recs]
        phi, decay, root = np.repeat(of_each, len(levels), axis=0).T
        scaled = np.tile(self.residual[:, None] / spread, len(recs))
        e = _innovations(scaled, phi, decay, root, self.starts)
        squares = np.sum(e * e, axis=0).reshape(len(recs), -1)
        log_spread, out = np.sum(np.log(spread), axis=0), []
        for (tau, white), rec, its in zip(shapes, recs, squares, strict=True):
            log_its = log_spread + 0.5 * n * math.log(rec.variance)
            for level, square, log_size in zip(levels, its, log_its, strict=True):
                size = max(math.sqrt(square / n), LEAST_NOISE_M_S2)
                score = -n * math.log(size) - log_size - 0.5 * square / size**2
                out.append((float(score), AxisNoise(size, size * (level / mean), tau, white)))
        return out


def _score(trial: tuple[float, AxisNoise]) -> float:
    return trial[0]


def rms(x: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")
