"""Accelerometer noise in the regressors: what of a regressor's information is not signal.

The regressors of the scale are integrals of *noisy* accelerations (errors in variables).  Unit
white noise on each axis is carried through the same integrals and the same whitening as the
regressors are; its square in the whitened innovations, times its density, is the expected part of
the sums that is noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.limits import FEWEST_NOISE_MEANS, NOISE_MEAN_S
from onboard.core.filter.state import STATES, V
from onboard.core.maths.arrays import Array

Index = NDArray[np.intp]

_EYE = np.eye(STATES)


class RegressorNoise:
    """Carries unit white noise of three body axes along with a filter; owns its Gram.

    Attributes:
        gram: (3,) sum since :meth:`begin_block` of the whitened noise squared, per unit density
            ((m/s^2)^2 s) of each body axis.
    """

    def __init__(self) -> None:
        self.gram = np.zeros(3)
        self._Xi = np.zeros((3, STATES, STATES))

    def forget(self) -> None:
        """The filter starts anew: no noise has been integrated yet.  The Gram stays."""
        self._Xi[:] = 0.0

    def begin_block(self) -> None:
        """Count the Gram from here on; the noise that was integrated goes on."""
        self.gram = np.zeros(3)

    def predict(self, F: Array, R_nb: Array, duration: float) -> None:
        """Through one interval with transition ``F`` (n, n) and attitude ``R_nb`` (3, 3)."""
        self._Xi = F @ self._Xi @ F.T
        self._Xi[:, V, V] += duration * R_nb.T[:, :, None] * R_nb.T[:, None, :]

    def update(self, whitener: Array, back: Array, read: tuple[Index, Index, Index]) -> None:
        """Through one update.

        Args:
            whitener: (r, r) inverse of the Cholesky factor of the innovation's covariance.
            back: (n, r) gain times that factor.
            read: the first two say which two states each row reads.
        """
        first, second, _ = read
        picked = self._Xi[:, first] + self._Xi[:, second]
        square = picked[:, :, first] + picked[:, :, second]
        # The trace of a product of symmetric matrices is the sum of their elements' products.
        self.gram += (square * (whitener.T @ whitener)).sum(axis=(1, 2))
        # (I - K H) Xi (I - K H)^T with K = back times the whitener.
        gain = _EYE.copy()
        K = back @ whitener
        gain[:, first] -= K
        gain[:, second] -= K
        self._Xi = gain @ self._Xi @ gain.T


def sample_noise_density(t: Array, raw: Array) -> Array:
    """Density (m/s^2)^2 s of what looks like white noise in each axis' samples.

    Samples are averaged over :data:`NOISE_MEAN_S`, third differences of the means take the
    manoeuvre out (white noise: 20 times its variance), and the median absolute deviation ignores
    the few jerks that are left.

    Args:
        t: (n,) s.
        raw: (n, 3) sensor axes, m/s^2.

    Returns:
        (3,) sensor axes; zeros where there are too few samples to tell.
    """
    step = (t[-1] - t[0]) / max(len(t) - 1, 1)
    size = max(1, round(NOISE_MEAN_S / step))
    count = len(t) // size
    if count < FEWEST_NOISE_MEANS:
        return np.zeros(3)
    blocks = raw[: count * size].reshape(count, size, 3).mean(axis=1)
    third = np.diff(blocks, n=3, axis=0)
    sigma = np.median(np.abs(third - np.median(third, axis=0)), axis=0) / 0.6745 / np.sqrt(20.0)
    out: Array = sigma**2 * size * step
    return out
