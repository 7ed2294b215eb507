"""A step at any moment of a series whose noise wanders: how much it explains, and its size.

The noise is white plus a first-order Gauss-Markov process.  Sampled evenly that is an ARMA(1, 1)
process, whose innovations a filter of one state makes (Box and Jenkins 1970).  How much of the
variance wanders, and how slowly, a short series cannot tell: likelihoods are summed over a grid of
both, restricted ones (Patterson and Thompson 1971), for what columns have taken is no noise.  The
level is profiled in each.  What a step becomes in the filter is the same wherever it begins, so all
moments cost one more filter, backwards.

The samples are means over windows: a step begins inside of one, which may be anything.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from onboard.core.maths.arrays import Array

SHARES = np.array([0.0, 0.1, 0.3, 0.6, 0.9, 0.97])
"""Of the variance that wanders [cost: neighbours differ by little in likelihood]."""
CONSTANTS = 6
"""Time constants that are tried, between two samples and half of the series [cost]."""
LONGEST = 1200
"""Samples that are gone through at once: a step shows in those around it [cost: memory]."""
TOLD = 1e-6
"""Of a step, the share of its square that other columns must leave: below is rounding [bound]."""
TINY = 1e-300
"""No sum of squares is less, for its logarithm is taken."""


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps that are whole from each sample of a series of n on.

    Attributes:
        gain: (n,) twice the rise of the log-likelihood by a step there, the sample before being
            anything.
        size: (n,) of that step.
        before: (n,) what the sample before it has of it.
        variance: (n,) of the size; infinite where the series tells nothing of it.
        odd: (n,) twice the rise by that sample alone being anything, without a step; of the last
            one nobody asks.
    """

    gain: Array
    size: Array
    before: Array
    variance: Array
    odd: Array


def steps_in(y: Array, H: Array, information: Array, floor: float = 0.0) -> Steps:
    """Steps of a series beside columns that are in it anyway.

    Each is judged by the :data:`LONGEST` samples around it.

    Args:
        y: (n,) evenly spaced.
        H: (n, k) columns.
        information: (k,) prior information of their coefficients, about zero.
        floor: sigma of noise that is there, whatever the series looks like.
    """
    n, half = len(y), LONGEST // 2
    if n <= LONGEST:
        return _steps_in(y, H, information, floor)
    made = [np.empty(n) for _ in fields(Steps)]
    starts = [*range(0, n - LONGEST, half), n - LONGEST]
    for start in starts:
        part = slice(start, start + LONGEST)
        found = _steps_in(y[part], H[part], information, floor)
        # What is nearer to its beginning was nearer to the middle of the part before.
        kept = 0 if start == 0 else half // 2
        for whole, field in zip(made, fields(Steps), strict=True):
            whole[start + kept : start + LONGEST] = getattr(found, field.name)[kept:]
    return Steps(*made)


def _steps_in(y: Array, H: Array, information: Array, floor: float) -> Steps:
    n, k = H.shape
    grid = _Grid.over(n)
    white = grid.whitened(np.column_stack([y, H]))
    z, W = white[..., 0], white[..., 1:]
    b = np.einsum("gnk,gn->gk", W, z)
    gram = np.einsum("gnk,gnl->gkl", W, W)
    freedom = max(n - k - 2, 1)
    squares = np.sum(z**2, axis=1) + freedom * floor**2
    # Two rounds for the level, with which the prior is weighed.
    chi2 = squares
    for _ in range(2):
        A = gram + (chi2 / freedom)[:, None, None] * np.diag(information)
        inverse = np.linalg.inv(A)
        theta = np.einsum("gkl,gl->gk", inverse, b)
        chi2 = np.maximum(squares - np.einsum("gk,gk->g", b, theta), TINY)
    step, pulse, both, products = grid.stepped(white)
    # Of step and pulse, what the columns leave: squares, product, and what the series asks.
    left = [p[..., 1:] for p in products]
    taken = [np.einsum("gnk,gkl->gnl", p, inverse) for p in left]
    step = step - np.einsum("gnk,gnk->gn", taken[0], left[0])
    pulse = pulse - np.einsum("gnk,gnk->gn", taken[1], left[1])
    both = both - np.einsum("gnk,gnk->gn", taken[0], left[1])
    asked, nudged = (p[..., 0] - np.einsum("gnk,gk->gn", p[..., 1:], theta) for p in products)
    beside = nudged / pulse
    known = step - both**2 / pulse
    tells = known > TOLD * np.abs(step)
    known = np.where(tells, known, 1.0)
    size = np.where(tells, (asked - both * beside) / known, 0.0)
    without = np.maximum(chi2[:, None] - nudged * beside, TINY)
    with_it = np.maximum(without - known * size**2, TINY)
    scale = np.log(grid.sigma) - 0.5 * np.linalg.slogdet(A)[1]
    plain = scale[:, None] - 0.5 * freedom * np.log(np.maximum(chi2, TINY))[:, None]
    before = scale[:, None] - 0.5 * freedom * np.log(without)
    after = scale[:, None] - 0.5 * freedom * np.log(with_it)
    weight = np.exp(after - np.max(after, axis=0))
    weight /= weight.sum(axis=0)
    told = np.all(tells, axis=0)
    mean = np.sum(weight * size, axis=0)
    partial = np.sum(weight * (nudged - both * size) / pulse, axis=0)
    odd = np.append(2.0 * (_log_sum(before) - _log_sum(plain))[1:], 0.0)
    each = with_it / freedom / known + (size - mean) ** 2
    return Steps(
        np.where(told, 2.0 * (_log_sum(after) - _log_sum(before)), 0.0),
        mean,
        partial,
        np.where(told, np.sum(weight * each, axis=0), np.inf),
        odd,
    )


@dataclass(frozen=True, slots=True)
class _Grid:
    """Processes that are tried, g of them: e_k = y_k - keep y_(k-1) + back e_(k-1)."""

    keep: Array
    back: Array
    sigma: Array
    """Of the innovations, of a series of unit variance."""

    @classmethod
    def over(cls, n: int) -> _Grid:
        constant = np.geomspace(2.0, max(n / 2.0, 3.0), CONSTANTS)
        share, constant = (x.ravel() for x in np.meshgrid(SHARES, constant))
        keep = np.where(share > 0.0, np.exp(-1.0 / constant), 0.0)
        # Autocovariances of y_k - keep y_(k-1), which is a moving average of the innovations.
        first = keep * (1.0 - share)
        zeroth = share * (1.0 - keep**2) + (1.0 - share) * (1.0 + keep**2)
        back = 2.0 * first / (zeroth + np.sqrt(np.maximum(zeroth**2 - 4.0 * first**2, 0.0)))
        sigma = np.sqrt(zeroth / (1.0 + back**2))
        once = np.unique(np.column_stack([keep, back, sigma]), axis=0)
        return cls(*once.T)

    def whitened(self, x: Array) -> Array:
        """(g, n, k) innovations of columns (n, k)."""
        out = np.empty((len(self.keep), *x.shape))
        keep, back = self.keep[:, None], self.back[:, None]
        out[:, 0] = self.sigma[:, None] * x[0]
        for i in range(1, len(x)):
            out[:, i] = x[i] - keep * x[i - 1] + back * out[:, i - 1]
        return out

    def stepped(self, white: Array) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        """Steps from each sample on, and pulses at the sample before it, whitened.

        A step becomes ``c + (1 - c) back^m`` after ``m`` samples, with what it comes to, ``c``; a
        pulse ``(back - keep) back^(m - 1)``, but one at once.

        Returns:
            (g, n) squares of the steps, of the pulses, products of both; (g, n, k) products of the
            steps, and of the pulses, with whitened columns (g, n, k).
        """
        n = white.shape[1]
        back, swing = self.back[:, None], (self.back - self.keep)[:, None]
        c = (1.0 - self.keep[:, None]) / (1.0 - back)
        rest = np.cumsum(white[:, ::-1], axis=1)[:, ::-1]
        fading = np.empty_like(white)
        fading[:, -1] = white[:, -1]
        for i in range(n - 2, -1, -1):
            fading[:, i] = white[:, i] + back * fading[:, i + 1]
        along = c[..., None] * rest + (1.0 - c[..., None]) * fading
        nudge = swing[..., None] * fading
        nudge[:, 1:] += white[:, :-1]
        m = np.arange(n, 0, -1.0)
        once, twice = (1.0 - back**m) / (1.0 - back), (1.0 - back ** (2.0 * m)) / (1.0 - back**2)
        step = c**2 * m + 2.0 * c * (1.0 - c) * once + (1.0 - c) ** 2 * twice
        pulse = 1.0 + swing**2 * twice
        both = swing * (c * once + (1.0 - c) * twice)
        return step, pulse, both, (along, nudge)


def _log_sum(x: Array) -> Array:
    """(n,) logarithm of sums of exponentials over the first axis of (g, n)."""
    most = np.max(x, axis=0)
    out: Array = most + np.log(np.sum(np.exp(x - most), axis=0))
    return out
