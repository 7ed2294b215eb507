"""All accelerometers of a vehicle at once: what each knows by GPS, and what pairs of them know.

Solutions of one flight share GPS and attitude and their errors, by an amount that nobody knows.  So
they do not add up: the covariance of all of them stacked is at most ``n`` times the block diagonal
one, whatever the correlations are (covariance intersection with equal weights, Julier and Uhlmann
1997), and each brings ``1 / n`` of its information.  Differences are known without either, from
pairs (:mod:`onboard.core.estimate.relative`).  Of ``n`` accelerometers there are ``n (n - 1) / 2``
pairs but only ``n - 1`` independent differences: each pair brings ``2 / n`` of its information,
which is exactly what is there if all are alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.estimate.limits import OFFSET_FLOOR, SCALE_FLOOR
from onboard.core.estimate.relative import Relative
from onboard.core.estimate.result import Calibration
from onboard.core.maths.accelerometer import SixParameters, linear_of, parameters_jacobian
from onboard.core.maths.accelerometer import parameters_of as six_of
from onboard.core.maths.arrays import Array

FLOOR = np.repeat([SCALE_FLOOR, OFFSET_FLOOR], 3)


@dataclass(frozen=True, slots=True)
class Single:
    """One accelerometer by itself, as scale and beta: estimate, prior, and what the flight adds.

    Attributes:
        imu: which.
        before: (6,) in force, centre of the prior.
        prior_sigma: (6,) of it.
        estimate: (6,) posterior.
        covariance: (6, 6) of it.
        information: (6, 6) of the flight alone.
        vector: (6,) information times the change that the flight asks for.
        gyro_sigma: (6,) of scale (1) and offset (m/s^2): what its gyroscope has put into them.
    """

    imu: int
    before: Array
    prior_sigma: Array
    estimate: Array
    covariance: Array
    information: Array
    vector: Array
    gyro_sigma: Array


def single(c: Calibration) -> Single | None:
    """A calibration without its prior; None if it has no covariance."""
    six, P = np.array(c.scale + c.offset), np.array(c.covariance, dtype=np.float64)
    in_force = SixParameters(c.in_force_scale, c.in_force_offset)
    gyro = np.array(c.gyro_sigma)
    return without_prior(c.imu, in_force, np.array(c.prior_sigma), six, P, gyro)


def without_prior(
    imu: int,
    in_force: SixParameters,
    prior_sigma: Array,
    six: Array,
    P: Array,
    gyro_sigma: Array | None = None,
) -> Single | None:
    """What a flight alone says of one accelerometer; None if that has no covariance.

    Args:
        imu: which.
        in_force: centre of the prior.
        prior_sigma: (6,) of scale (1) and of beta (m/s^2).
        six: (6,) estimate, scale (1) and offset (m/s^2).
        P: (6, 6) covariance of it.
        gyro_sigma: (6,) what of its sigmas comes from the gyroscope; None: nothing.
    """
    if not (np.all(np.isfinite(six)) and np.all(np.isfinite(P))):
        return None
    before = in_force.as_linear()
    estimate = linear_of(six)
    back = np.linalg.inv(parameters_jacobian(estimate))
    covariance = back @ P @ back.T
    unit = prior_sigma
    try:
        inverse = np.linalg.inv(covariance / np.outer(unit, unit))
    except np.linalg.LinAlgError:
        return None
    # In units of the prior; directions in which it would lose information bring none.
    share, V = np.linalg.eigh((inverse + inverse.T) / 2 - np.eye(6))
    share = np.maximum(share, 0.0)
    asked = V.T @ inverse @ ((estimate - before) / unit)
    asked[share <= 0.0] = 0.0
    information = (V * share) @ V.T / np.outer(unit, unit)
    vector = (V @ asked) / unit
    gyro = np.zeros(6) if gyro_sigma is None else gyro_sigma
    return Single(imu, before, unit, estimate, covariance, information, vector, gyro)


@dataclass(frozen=True, slots=True)
class Joint:
    """Posterior of all accelerometers of a vehicle together.

    Attributes:
        imus: which, n of them.
        before: (n, 6) scale and offset in force.
        value: (n, 6) scale (1) and offset (m/s^2), sensor axes.
        covariance: (6 n, 6 n) of it.
    """

    imus: tuple[int, ...]
    before: Array
    value: Array
    covariance: Array

    def of(self, imu: int) -> tuple[Array, Array]:
        """(6,) scale and offset of one accelerometer and their covariance (6, 6)."""
        i = self.imus.index(imu)
        cut = slice(6 * i, 6 * i + 6)
        return self.value[i], self.covariance[cut, cut]

    def number(self, index: int) -> Array:
        """(n, n) covariance of one of the six numbers over the accelerometers."""
        every = np.arange(index, 6 * len(self.imus), 6)
        return self.covariance[np.ix_(every, every)]


def joint(singles: Sequence[Single], relatives: Sequence[Relative]) -> Joint:
    """Put together what accelerometers know by themselves and what pairs of them know.

    Args:
        singles: at least one.
        relatives: pairs of them, all there are or some.
    """
    n = len(singles)
    return stacked(singles, relatives, np.full(n, 1.0 / n))


def stacked(singles: Sequence[Single], relatives: Sequence[Relative], weights: Array) -> Joint:
    """The same with shares of each accelerometer's information that need not be equal.

    Args:
        singles: at least one.
        relatives: pairs of them, all there are or some.
        weights: (n,) not negative; the sum is one.
    """
    n = len(singles)
    place = {s.imu: slice(6 * i, 6 * i + 6) for i, s in enumerate(singles)}
    N, b = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
    for s, weight in zip(singles, weights, strict=True):
        cut = place[s.imu]
        N[cut, cut] += weight * s.information + np.diag(s.prior_sigma**-2.0)
        b[cut] += weight * s.vector
    for r in relatives:
        both = np.r_[place[r.imus[0]], place[r.imus[1]]]
        N[np.ix_(both, both)] += 2.0 / n * r.information
        b[both] += 2.0 / n * r.vector
    unit = np.sqrt(np.diag(N))
    covariance = np.linalg.inv(N / np.outer(unit, unit)) / np.outer(unit, unit)
    before = np.stack([s.before for s in singles])
    linear = before + (covariance @ b).reshape(n, 6)
    J = np.zeros((6 * n, 6 * n))
    for s, x in zip(singles, linear, strict=True):
        J[place[s.imu], place[s.imu]] = parameters_jacobian(x)
    spread = J @ covariance @ J.T
    return Joint(
        tuple(s.imu for s in singles),
        np.stack([six_of(x) for x in before]),
        np.stack([six_of(x) for x in linear]),
        (spread + spread.T) / 2,
    )


def disagreement(relative: Relative, a: Single, b: Single) -> float:
    """Chi-square, three degrees of freedom, of two solutions against what the pair itself has.

    Errors that both share leave their difference alone; what remains, and its covariance, is

    * what the two priors pull, ``C P0^-1 C`` each: the values in force are wrong independently;
    * the difference of the two covariances, without that: of two efficient estimates from the same
      noise one knows what the other knows and more (Hausman 1978);
    * the accelerometers' own noise, as the pair shows it, once in the solutions and once in the
      pair: the same noise, so this is rather too much;
    * the floors of both, for what no model knows;
    * what their gyroscopes' axes have put into both; where one gyroscope carried both, too much.

    What one gyroscope does wrong beside is in one solution only where each accelerometer is solved
    with its own, and shows here.  Priors are taken for independent.
    """
    off = relative.difference(a.estimate, b.estimate) - relative.own
    apart = 2.0 * relative.own_covariance
    shared = []
    for s, J in ((a, relative.weights[:, :6]), (b, relative.weights[:, 6:])):
        pull = J @ s.covariance @ np.diag(s.prior_sigma**-2.0) @ s.covariance @ J.T
        shared.append(J @ s.covariance @ J.T - pull)
        apart += pull + (J * (FLOOR**2 + s.gyro_sigma**2)) @ J.T
    size, V = np.linalg.eigh(shared[0] - shared[1])
    apart += (V * np.abs(size)) @ V.T
    return float(off @ np.linalg.solve(apart, off))
