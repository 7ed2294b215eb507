"""Newton's step for noise levels: where their log-likelihood is highest, as far as a stencil tells.

Slope and curvature along each level are those of the parabola through its three values.  What two
levels have in common is in what they change the whitened innovations by: levels that change them
alike stand in for each other, and steps that leave that out are too long for all of them together
(real flights end 20 to 150 of the log-likelihood below the top).  The products of those changes
are Fisher's information (Watson and Engle, 1983) of two levels; of one by itself the curvature is
the likelihood's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import ESTIMATED, NoiseLevels, on_the_way, triple
from onboard.core.maths.arrays import Array

SWEEPS = 200
"""Sweeps over the levels that a bounded step takes at the most: it is within a thousandth of a
level after some dozens, where levels trade [cost]."""
CLOSE = 1e-4
"""Log ratio that is not worth another sweep [cost]."""
FAR = 0.3
"""Log ratio by which a parabola of the log has a level fall, from which on it is followed by its
variance: more than a stencil has seen, less than the half that a straight line gives [bound]."""
LONGEST_STEP = float(np.log(4.0))
"""Of the log of a level: further off neither parabola nor products are what they are here
[cost]."""
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

    def shortened(self, centre: NoiseLevels, share: float) -> NoiseStep:
        """The first part of the way from ``centre``, and what the parabola says of it."""
        levels = on_the_way(centre, self.levels, share)
        return NoiseStep(levels, self.gain * share * (2.0 - share), cut=True)


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
    slope, curve = np.einsum("nij,nj->in", _parabolas(x), rise)
    falls = slope < FAR * np.minimum(curve, 0.0)
    to_parabola = _parabolas(_bent(x, falls[:, None]))
    slope, curve = np.einsum("nij,nj->in", to_parabola, rise)
    # A deviation that grows by a share makes an innovation smaller by it, and Fisher's information
    # of it is two.
    products = 2.0 * _products(to_parabola[:, 0], trades)
    own = np.diag(products)
    # Where it bends upwards a level is far from its top: what it does to the innovations bounds it.
    bend = np.where(curve < -LEAST_CURVATURE, -curve, own + LEAST_CURVATURE)
    share = np.sqrt(bend / np.maximum(own, bend))
    H = products * np.outer(share, share)
    np.fill_diagonal(H, bend * (1.0 + 1e-9))
    low, high = np.clip(np.log(limits / here[:, None]), -LONGEST_STEP, LONGEST_STEP).T
    bent = bounded(H, slope, _bent(low, falls), _bent(high, falls))
    step = np.where(falls, np.log1p(2.0 * np.where(falls, bent, 0.0)) / 2.0, bent)
    found = centre
    for name, by in zip(names, np.exp(step).tolist(), strict=True):
        found = found.scaled(name, by)
    gain = float(slope @ bent - 0.5 * bent @ H @ bent)
    return NoiseStep(found, gain, bool(np.abs(step).max() >= LONGEST_STEP))


def _parabolas(u: Array) -> Array:
    """(n, 2, 2) from rises at two places ``u`` (n, 2) to slope and curvature at none.

    The parabola through the origin and both: rise = slope u + curve u^2 / 2.
    """
    out: Array = np.linalg.inv(np.stack([u, u * u / 2.0], axis=2))
    return out


def _bent(x: Array, falls: NDArray[np.bool_]) -> Array:
    """Log ratios of levels in what their likelihood is a parabola of: variances where it falls.

    A level whose top is far below is small beside other noise, to which it adds its variance: in
    the log of it the way to nothing never ends, half a level each step.  One that is too small is
    all the noise that there is, and too small by a ratio.  Both have slope one at the centre.
    """
    return np.where(falls, np.expm1(2.0 * x) / 2.0, x)


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
