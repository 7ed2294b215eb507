"""From scores with the noise that blocks confirm to an estimate and its covariance."""

from __future__ import annotations

import numpy as np

from onboard.core.estimate.pool import TINY
from onboard.core.maths.arrays import Array


def directions_of(information: Array, prior_information: Array) -> tuple[Array, Array]:
    """Directions that are independent in the data and in the prior alike.

    Args:
        information: (m, m) of the data.
        prior_information: (m,) of the prior, independent unknowns.

    Returns:
        X (m, m) with ``X^T P X = 1``, and (m,) what the data know along each, in units of the
        prior.
    """
    root = 1.0 / np.sqrt(prior_information)
    strength, turned = np.linalg.eigh(information * np.outer(root, root))
    return root[:, None] * turned, strength


class Weighing:
    """Data with what the sums claim, and a prior, to an estimate with what blocks confirm.

    In the coordinates ``X``, counted from the prior's centre, the prior is one and the data are
    ``strength``; their noise is ``V`` times that.  Each direction is weighed by its own variance.
    That the noise of two goes together is in the covariance alone: as a weight it would have to be
    known better than blocks tell it, and made a plane's estimates a third worse.
    """

    def __init__(self, X: Array, strength: Array, V: Array) -> None:
        """Take directions (m, m), information along them (m,) and noise (m, m)."""
        self.X = X
        self.weights: Array = 1.0 / np.diag(V)
        root = np.sqrt(np.maximum(strength, TINY))
        size, turned = np.linalg.eigh(V)
        half = (turned * np.sqrt(size)) @ turned.T
        self._noisy: Array = self.weights[:, None] * half * np.outer(root, 1.0 / root)
        self.information: Array = np.maximum(strength, 0.0) * self.weights
        self.gain: Array = X / (self.information + 1.0)

    def estimate(self, score: Array) -> Array:
        """(m,) from what the data ask for beyond the prior's centre, (m,)."""
        out: Array = self.gain @ (self.weights * (self.X.T @ score))
        return out

    def noise(self, claimed: Array) -> Array:
        """(m, m) along ``X`` of weighted scores of which the sums claim the noise (m, m)."""
        back = self._noisy @ self.X.T
        out: Array = back @ claimed @ back.T
        return out

    def covariance(self, noise: Array) -> Array:
        """(m, m) of the estimate, with that noise of the weighted scores."""
        out: Array = self.gain @ (noise + np.eye(len(noise))) @ self.gain.T
        return (out + out.T) / 2
