"""Newton's step for noise levels: where their log-likelihood is highest, as far as a stencil tells.

Slope and curvature along each level are those of the parabola through its three values.  What two
levels have in common is in what they change the whitened innovations by: levels that change them
alike stand in for each other, and steps that leave that out are too long for all of them together
(real flights end 20 to 150 of the log-likelihood below the top).  The products of those changes
are the part of Fisher's information that is of the mean (Watson and Engle, 1983), and give the
correlations; the curvature is the likelihood's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.filter.limits import LIMITS, STENCIL_FACTOR
from onboard.core.filter.noise import ESTIMATED, NoiseLevels, triple
from onboard.core.maths.arrays import Array

SWEEPS = 200
"""Sweeps over the levels that a bounded step takes at the most: it is within a thousandth of a
level after some dozens, where levels trade [cost]."""
CLOSE = 1e-4
"""Log ratio that is not worth another sweep [cost]."""
LEAST_CURVATURE = 1e-6
"""Of a level that the likelihood says nothing of: its step is then what its bounds are [bound]."""


@dataclass(frozen=True, slots=True)
class NoiseStep:
    """A step of the levels.

    Attributes:
        levels: where it ends.
        gain: how much more log-likelihood is expected there.
        cut: whether it would go further, were it not longer than a stencil can tell.
    """

    levels: NoiseLevels
    gain: float
    cut: bool


def newton_step(
    centre: NoiseLevels,
    log_likelihood: Sequence[float],
    trades: Array,
    names: Sequence[str] = ESTIMATED,
) -> NoiseStep:
    """Step to the expected top, inside the limits and no longer than a stencil can tell.

    Args:
        centre: of the stencil.
        log_likelihood: of the members of :func:`~onboard.core.filter.noise.stencil`.
        trades: (B, B) products of what each member changes the whitened innovations by.
        names: levels that the stencil has.
    """
    here = np.array([getattr(centre, name) for name in names])
    limits = np.array([LIMITS[name] for name in names])
    x = np.array([np.log(triple(a, (b, c))) for a, (b, c) in zip(here, limits, strict=True)])
    x -= np.log(here)[:, None]
    rise = np.array(log_likelihood[1:]).reshape(-1, 2) - log_likelihood[0]
    # The parabola through the origin and both points: rise = slope x + curve x^2 / 2.
    to_parabola = np.linalg.inv(np.stack([x, x * x / 2.0], axis=2))
    slope, curve = np.einsum("nij,nj->in", to_parabola, rise)
    products = _products(to_parabola[:, 0], trades)
    own = np.diag(products)
    # Where it bends upwards a level is far from its top: what it does to the innovations bounds it.
    bend = np.where(curve < -LEAST_CURVATURE, -curve, 2.0 * own + LEAST_CURVATURE)
    size = np.sqrt(np.maximum(own, np.finfo(float).tiny))
    H = products / np.outer(size, size) * np.sqrt(np.outer(bend, bend))
    np.fill_diagonal(H, bend * (1.0 + 1e-9))
    longest = 2.0 * float(np.log(STENCIL_FACTOR))
    low, high = np.clip(np.log(limits / here[:, None]), -longest, longest).T
    step = bounded(H, slope, low, high)
    found = centre
    for name, by in zip(names, np.exp(step).tolist(), strict=True):
        found = found.scaled(name, by)
    gain = float(slope @ step - 0.5 * step @ H @ step)
    return NoiseStep(found, gain, bool(np.abs(step).max() >= longest))


def _products(slopes: Array, trades: Array) -> Array:
    """(n, n) products of the changes per unit of the log of each of n levels.

    Args:
        slopes: (n, 2) weights of the two members of each level in its derivative.
        trades: (2 n + 1, 2 n + 1) products of the changes of the members.
    """
    n = len(slopes)
    pairs = trades[1:, 1:].reshape(n, 2, n, 2)
    out: Array = np.einsum("ia,iajb,jb->ij", slopes, pairs, slopes)
    return out


def bounded(H: Array, slope: Array, low: Array, high: Array) -> Array:
    """(n,) maximum of ``slope x - x H x / 2`` with ``low <= x <= high``.

    By turns along each coordinate, which converges for every ``H`` (n, n) that is positive
    semidefinite with a positive diagonal.
    """
    x = np.zeros(len(slope))
    for _ in range(SWEEPS):
        before = x.copy()
        for i in range(len(x)):
            x[i] += (slope[i] - H[i] @ x) / H[i, i]
            x[i] = min(max(x[i], low[i]), high[i])
        if np.abs(x - before).max(initial=0.0) < CLOSE:
            break
    return x
