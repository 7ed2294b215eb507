"""What two accelerometers of one vehicle say of each other, without GPS.

They feel one trajectory, so over windows of about a second (:mod:`shared_windows`)

    s_a m_a + beta_a - (s_b m_b + beta_b) - lever - W d = e

for each axis, with ``m`` the mean raw samples, ``lever`` what their configured places do and ``d``
the unknown rest of their distance.  An axis determines two of its four numbers, a difference of
gains and one of offsets; the rest keeps its prior.

*Regressors.*  Noise in ``m_a`` and ``m_b`` would be fitted by making both scales small, for that
makes the residual small.  So the derivative is taken at the force that both agree on, the mean of
the two: its noise is uncorrelated with that of their difference where both are alike.

*Noise.*  Its level is that of the residuals.  Misalignment, temperature and vibration leave them
correlated, so the variance is inflated for it (:mod:`onboard.core.estimate.wandering`), that of
their mean and that of what varies with the force each by its own factor: what wanders spoils an
offset more than a gain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onboard.core.estimate.limits import (
    FEWEST_WINDOWS,
    LIKE_SIGMAS,
    MISPLACED_M,
    OUTLYING,
    PAIR_NOISE_FLOOR,
    UNKNOWN_PLACE_M,
)
from onboard.core.estimate.shared_windows import SharedWindows
from onboard.core.estimate.wandering import STEADY_GAIN, STEADY_OFFSET
from onboard.core.estimate.wandering import inflation as inflation_of
from onboard.core.maths.arrays import Array
from onboard.core.maths.medians import NORMAL_MEDIAN

ROUNDS = 4
"""The agreed force moves with the estimate: it stands still after two or three rounds [cost]."""


@dataclass(frozen=True, slots=True)
class Relative:
    """Two accelerometers relative to each other; unknowns are (scale, beta) of a, then of b.

    Attributes:
        imus: accelerometers a and b.
        windows: how many were compared.
        refused: how many more were outliers.
        before: (12,) in force, and centre of the prior.
        theta: (12,) posterior.
        covariance: (15, 15) of it and of the unknown rest of the distance.
        information: (12, 12) of the flight alone, that distance eliminated.
        vector: (12,) information times the change that the flight asks for.
        distance: (3,) unknown rest of the distance, body axes, m: how much further a is from b.
        noise: (3,) sigma of a window's difference, m/s^2.
        inflation: (2, 3) factors, at least 1, on the variance of its mean and of what varies.
        mean_raw: (2, 3) mean raw samples of a and b, sensor axes, m/s^2.
        lever: (3,) mean of what the configured places do, m/s^2.
    """

    imus: tuple[int, int]
    windows: int
    refused: int
    before: Array
    theta: Array
    covariance: Array
    information: Array
    vector: Array
    distance: Array
    noise: Array
    inflation: Array
    mean_raw: Array
    lever: Array

    @property
    def weights(self) -> Array:
        """(3, 12) derivative of the mean difference of the forces by the unknowns."""
        one = np.eye(3)
        a, b = self.mean_raw
        return np.hstack([np.diag(a), one, -np.diag(b), -one])

    def difference(self, a: Array, b: Array) -> Array:
        """(3,) mean force of a less that of b, by any calibration, m/s^2.

        Args:
            a: (6,) scale and beta of a.
            b: of b.
        """
        out: Array = self.weights @ np.concatenate([a, b]) - self.lever
        return out

    @property
    def own(self) -> Array:
        """(3,) what :meth:`difference` is as the pair itself has it, m/s^2.

        It is what the unknown rest of the distance does: next to nothing.
        """
        return self.difference(self.theta[:6], self.theta[6:])

    @property
    def own_covariance(self) -> Array:
        """(3, 3) of :attr:`own`."""
        out: Array = self.weights @ self.covariance[:12, :12] @ self.weights.T
        return out

    @property
    def mean_force(self) -> Array:
        """(3,) mean force of a, m/s^2."""
        out: Array = self.theta[:3] * self.mean_raw[0] + self.theta[3:6]
        return out

    def loosened(self, sigma: Array) -> Relative:
        """The pair where each of its two has an error of its own beside.

        Args:
            sigma: (12,) of it, in scale (1) and beta (m/s^2) of a, then of b.
        """
        spoilt = np.eye(12) + self.information @ np.diag(sigma**2)
        information = np.asarray(np.linalg.solve(spoilt, self.information), np.float64)
        vector = np.asarray(np.linalg.solve(spoilt, self.vector), np.float64)
        return replace(self, information=(information + information.T) / 2, vector=vector)

    def other(self, a: Array, prior_sigma: Array) -> tuple[Array, Array]:
        """What b is if a is known: (6,) scale and beta, and their covariance (6, 6).

        Args:
            a: (6,) scale and beta of a.
            prior_sigma: (6,) of b.
        """
        R = self.information
        covariance = np.asarray(np.linalg.inv(R[6:, 6:] + np.diag(prior_sigma**-2.0)), np.float64)
        change = covariance @ (self.vector[6:] - R[6:, :6] @ (a - self.before[:6]))
        b: Array = self.before[6:] + change
        return b, covariance


def relative_of(
    imus: tuple[int, int], windows: SharedWindows, before: Array, prior_sigma: Array
) -> Relative | None:
    """Calibrate two accelerometers relative to each other; None if they share too little flight.

    Args:
        imus: accelerometers a and b.
        windows: what they share.
        before: (12,) scale and beta in force of a, then of b.
        prior_sigma: (12,) how well they are known.
    """
    if len(windows) < FEWEST_WINDOWS:
        return None
    kept, place = windows, UNKNOWN_PLACE_M
    fit = _Fit(kept, before, prior_sigma, place)
    spread = np.median(np.abs(fit.residual), axis=0) / NORMAL_MEDIAN + PAIR_NOISE_FLOOR
    well = np.all(np.abs(fit.residual) < OUTLYING * spread, axis=1)
    if not np.all(well) and int(np.sum(well)) >= FEWEST_WINDOWS:
        kept = windows.where(well)
        fit = _Fit(kept, before, prior_sigma, place)
    if np.any(np.abs(fit.distance) > LIKE_SIGMAS * place):  # configured wrongly: a slip of any size
        fit = _Fit(kept, before, prior_sigma, MISPLACED_M)
    inflation = fit.inflation()
    N, b = fit.information(inflation), fit.vector(inflation)
    covariance = np.linalg.inv(N + fit.prior)
    change = covariance @ b
    # The distance is eliminated with what is known of it beforehand.
    gain = N[:12, 12:] @ np.linalg.inv(N[12:, 12:] + fit.prior[12:, 12:])
    information = N[:12, :12] - gain @ N[12:, :12]
    return Relative(
        imus=imus,
        windows=len(kept),
        refused=len(windows) - len(kept),
        before=before.copy(),
        theta=before + change[:12],
        covariance=(covariance + covariance.T) / 2,
        information=(information + information.T) / 2,
        vector=b[:12] - gain @ b[12:],
        distance=change[12:],
        noise=np.sqrt(fit.variance),
        inflation=inflation,
        mean_raw=np.stack([kept.raw_a.mean(axis=0), kept.raw_b.mean(axis=0)]),
        lever=kept.lever.mean(axis=0),
    )


AXES = range(3)


class _Fit:
    """Least squares over windows, linear but for the force at which derivatives are taken."""

    def __init__(
        self, windows: SharedWindows, before: Array, prior_sigma: Array, place: float
    ) -> None:
        self.prior = np.diag(np.concatenate([prior_sigma, np.full(3, place)]) ** -2.0)
        self._windows = windows
        felt = self._forces(before)
        self._y = felt[0] - felt[1] - windows.lever
        self.variance: Array = np.var(self._y, axis=0) + PAIR_NOISE_FLOOR**2
        change = np.zeros(15)
        one = np.ones((2, 3))
        for _ in range(ROUNDS):
            self._H = self._rows(before + change[:12])
            N = self.information(one) + self.prior
            change = np.asarray(np.linalg.solve(N, self.vector(one)), np.float64)
            self.distance = change[12:]
            self.residual: Array = self._y - self._H @ change
            self.variance = np.mean(self.residual**2, axis=0) + PAIR_NOISE_FLOOR**2

    def _forces(self, x: Array) -> tuple[Array, Array]:
        w = self._windows
        return x[:3] * w.raw_a + x[3:6], x[6:9] * w.raw_b + x[9:12]

    def _rows(self, x: Array) -> Array:
        """(n, 3, 15) derivatives of the residual at the force that both agree on."""
        w = self._windows
        a, b = self._forces(x)
        self.force = (a + b + w.lever) / 2.0  # felt by a
        raw_a = (self.force - x[3:6]) / x[:3]
        raw_b = (self.force - w.lever - x[9:12]) / x[6:9]
        H = np.zeros((len(w), 3, 15))
        for j in range(3):
            H[:, j, j], H[:, j, 3 + j] = -raw_a[:, j], -1.0
            H[:, j, 6 + j], H[:, j, 9 + j] = raw_b[:, j], 1.0
        H[:, :, 12:] = w.swing
        return H

    def inflation(self) -> Array:
        """(2, 3) what correlation of the residuals adds to variances of mean and variation."""
        t, r = self._windows.t, self.residual
        varies = self.force - self.force.mean(axis=0)
        mean = [inflation_of(t, r[:, j], STEADY_OFFSET) for j in AXES]
        varying = [inflation_of(t, varies[:, j] * r[:, j], STEADY_GAIN) for j in AXES]
        return np.array([mean, varying])

    def information(self, inflation: Array) -> Array:
        """(15, 15) of the windows alone."""
        weights = 1.0 / (self.variance * inflation)
        mean, varies = self._split(self._H)
        out: Array = np.einsum("nji,j,njk->ik", varies, weights[1], varies)
        out += len(self._y) * np.einsum("ji,j,jk->ik", mean, weights[0], mean)
        return out

    def vector(self, inflation: Array) -> Array:
        """(15,) what goes with it."""
        weights = 1.0 / (self.variance * inflation)
        mean, varies = self._split(self._H)
        out: Array = np.einsum("nji,j,nj->i", varies, weights[1], self._y)
        out += len(self._y) * np.einsum("ji,j,j->i", mean, weights[0], self._y.mean(axis=0))
        return out

    @staticmethod
    def _split(H: Array) -> tuple[Array, Array]:
        mean: Array = H.mean(axis=0)
        return mean, H - mean
