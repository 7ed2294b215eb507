"""How much less a mean over a flight is known than white noise of the same size would have it.

Two ways, of which the worse counts.  Blocks of ten seconds show by the scatter of their sums what
is correlated within them (cluster-robust, as in :mod:`onboard.core.estimate.solution`).  What goes
on for longer, temperature say, leaves too few blocks in a flight, so there it is a model: white
noise and a first-order Gauss-Markov process.  Their likelihood is Whittle's (1953), of the
periodogram without its mean; time constants and shares that are as likely are averaged over, for
a short flight cannot tell them apart.
"""

from __future__ import annotations

import numpy as np

from onboard.core.estimate.limits import (
    CLUSTER_S,
    FEWEST_BLOCKS,
    ONE_IN_A_THOUSAND,
    SHARED_WINDOW_S,
    WARMING_S,
)
from onboard.core.maths.arrays import Array

SHARES = np.array([0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97])
"""Of the variance that wanders, those above none each as likely as the next beforehand."""
STEADY_GAIN = 0.5
"""How likely it is that what varies with the force does not wander: as likely as not, for nothing
that is known makes a gain another one within a flight [probability]."""
STEADY_OFFSET = 1.0 / len(SHARES)
"""The same of what does not vary with it: no likelier than any other share, for every offset
follows its sensor's temperature, and a short flight that does not show it is no evidence that it
does not [physics; with one half, quarters of flights for building differ by 2.1 times the variance
that they say, with this by 1.4]."""
CONSTANTS = 10
"""Time constants that are tried, between two windows and the longest [cost: a finer grid moves the
inflation by less than blocks scatter]."""


def inflation(t: Array, scores: Array, steady: float) -> float:
    """Variance of the mean of scores over that of white noise of the same size, at least 1.

    Args:
        t: (n,) when the windows begin, s.
        scores: (n,) whose mean the fit has made zero.
        steady: how likely it is beforehand that nothing of them wanders.
    """
    if float(np.mean(scores**2)) <= 0.0:
        return 1.0
    return max(1.0, _clustered(t, scores), _wandering(scores, steady))


def _clustered(t: Array, scores: Array) -> float:
    """Ratio of found to promised variance of the sums over blocks, if it is no chance."""
    length = min(CLUSTER_S, (t[-1] - t[0]) / (2.0 * FEWEST_BLOCKS))
    block = np.unique(np.floor((t - t[0]) / length), return_inverse=True)[1]
    count = np.bincount(block).astype(np.float64)
    if len(count) < FEWEST_BLOCKS:
        return 1.0
    # The fit has followed each block: its sum scatters less than its size.
    promised = np.mean(scores**2) * count * (1.0 - count / len(scores))
    ratio = float(np.sum(np.bincount(block, scores) ** 2) / np.sum(promised))
    # Wilson and Hilferty (1931): the cube root of chi-square is nearly normal.
    width = 2.0 * np.sum(promised**2) / (9.0 * np.sum(promised) ** 2)
    beyond = ratio > (1.0 - width + ONE_IN_A_THOUSAND * np.sqrt(width)) ** 3
    return ratio if beyond else 1.0


def _wandering(scores: Array, steady: float) -> float:
    """The same by a process that wanders, averaged over what is likely."""
    n = len(scores)
    periodogram = np.abs(np.fft.rfft(scores - scores.mean())[1:]) ** 2 / n
    turn = np.cos(2.0 * np.pi * np.arange(1, n // 2 + 1) / n)
    constant = np.geomspace(2.0, max(n / 2.0, WARMING_S / SHARED_WINDOW_S), CONSTANTS)[:, None]
    keep = np.exp(-1.0 / constant)
    # Spectra of unit variance; (constants, shares, frequencies).
    slow = (1.0 - keep**2) / (1.0 - 2.0 * keep * turn + keep**2)
    share = SHARES[None, :, None]
    S = share * slow[:, None, :] + (1.0 - share)
    level = np.mean(periodogram / S, axis=-1)
    likelihood = -np.sum(np.log(S), axis=-1) - len(turn) * np.log(level)
    weight = np.exp(likelihood - likelihood.max()) * np.where(SHARES == 0.0, steady, 1.0 - steady)
    weight[:, SHARES != 0.0] /= len(SHARES) - 1.0
    # Variance of a mean over n of a unit process, times n.
    mean = (1.0 + keep) / (1.0 - keep) - 2.0 * keep * (1.0 - keep**n) / (n * (1.0 - keep) ** 2)
    found = level * (SHARES * mean + (1.0 - SHARES))
    return float(np.sum(weight * found) / np.sum(weight) / np.mean(scores**2))
