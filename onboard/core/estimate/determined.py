"""What a flight determines of the six, and what setting just that is worth.

An ordinary flight does not show six numbers.  It shows some of them, and others in one combination
only: a hover knows ``scale (raw - offset)`` of the z axis at one load.  What is known can be set,
and the rest can stay, as long as both belong together:

1.  A number is *free* if its sigma has come down to half of the prior's, or if the flight
    contradicts the value in force; where neither number of an axis is, both are if their best
    combination is known as well.  The others are *held* at the value in force, and the free ones
    are those that belong to it: the conditional Gaussian,

        x_f' = x_f + P_fk P_kk^-1 (k - x_k),    P_f' = P_ff - P_fk P_kk^-1 P_kf

    How badly the flight contradicts holding them is ``(k - x_k)^T P_kk^-1 (k - x_k)``, chi-square
    with as many degrees of freedom as are held.
2.  Of the free ones, the directions count that the flight knows better than half of the prior, or
    in which it contradicts what is there (eigenvectors of ``P_f'`` in units of the prior); in the
    others the values in force stay.

What it is worth is counted in the force that the vehicle would have felt, over the loads that it
flew: with ``M`` the second moments of the error's regressors over the flight, calibrations ``x``
and ``y`` differ by ``sqrt((x - y)^T M (x - y))``, root mean square.  Setting ``w`` instead of what
is in force ``k`` is better by ``L(k) - L(w) = 2 d^T M (x - (k + w) / 2)`` with ``d = w - k``.  With
the truth ``x`` normal that is a normal number: its probability to be positive has a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.limits import PRIOR_SHARE
from onboard.core.estimate.result import Calibration, Six, SixFlags
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array, Vector3, vector3
from onboard.core.maths.chi_square import CHI_SQUARE_999
from onboard.core.maths.earth import STANDARD_GRAVITY

LEVEL_LOADS: Final = ((0.0, 0.0, -STANDARD_GRAVITY), (1.0, 1.0, STANDARD_GRAVITY**2 + 1.0))
"""Mean and mean square of the force at level rest, with 1 m/s^2 of motion in each axis."""


@dataclass(frozen=True, slots=True)
class Determined:
    """The six as they should be set, and what that is worth.

    Attributes:
        six: to be set: estimated where the flight tells, in force elsewhere, consistent as a set.
        free: which of them are not held at the value in force, in the order of SIX_NAMES.
        known: which of them the flight knows by itself; a free one that is not is half of a
            combination of scale and offset of its axis.
        directions: how many directions of the six the flight determines.
        sigma: of each number as it would be set again from another flight like this one: 0 where
            it is held.
        change: how far the force changes over this flight, root mean square, m/s^2.
        error_before: expected error of the force with what is in force, likewise.
        error_after: the same with :attr:`six`.
        probability: that the error becomes smaller.
        contradiction: squared distance of the held numbers from what the flight says.
        contradiction_limit: exceeded by it once in a thousand flights.
    """

    six: SixParameters
    free: SixFlags
    known: SixFlags
    directions: int
    sigma: Six
    change: float
    error_before: float
    error_after: float
    probability: float
    contradiction: float
    contradiction_limit: float


@dataclass(frozen=True, slots=True)
class Improvement:
    """What other values than those in force are worth, over a flight; m/s^2, root mean square.

    Attributes:
        change: how far the force changes.
        error_before: expected error of the force with what is in force.
        error_after: the same with the other values.
        probability: that the error becomes smaller.
    """

    change: float
    error_before: float
    error_after: float
    probability: float


def improvement(
    calibration: Calibration, in_force: Sequence[float] | Array, wanted: Sequence[float] | Array
) -> Improvement:
    """What setting some values is worth by a calibration.

    Args:
        calibration: the estimate with its covariance and the loads flown.
        in_force: (6,) scale (1) and offset (m/s^2), sensor axes.
        wanted: (6,) to be set instead.

    Raises:
        ValueError: the covariance is not finite, symmetric and positive definite.
    """
    x, P = _checked(*calibration.best)
    k = np.asarray(in_force, dtype=np.float64)
    M = force_moments(calibration.load_mean, calibration.load_square, k)
    d = np.asarray(wanted, dtype=np.float64) - k
    gain = 2.0 * d @ M @ (x - k) - d @ M @ d
    spread = 2.0 * math.sqrt(max(float(d @ M @ P @ M @ d), 0.0))
    return Improvement(
        change=math.sqrt(max(float(d @ M @ d), 0.0)),
        error_before=_error(x - k, M, P),
        error_after=_error(x - k - d, M, P),
        probability=0.5 * math.erfc(-gain / (math.sqrt(2.0) * spread)) if spread > 0.0 else 0.5,
    )


def determine(calibration: Calibration, in_force: Sequence[float]) -> Determined:
    """What a calibration determines beyond the values in force now.

    Args:
        calibration: the estimate with its covariance, the prior and the loads flown.
        in_force: (6,) scale (1) and offset (m/s^2), sensor axes.

    Raises:
        ValueError: the covariance is not finite, symmetric and positive definite.
    """
    x, P = _checked(*calibration.best)
    k = np.asarray(in_force, dtype=np.float64)
    prior = np.array(calibration.prior_sigma)
    known = np.sqrt(np.diag(P)) <= PRIOR_SHARE * prior
    contradicted = (x - k) ** 2 > CHI_SQUARE_999[1] * np.diag(P)
    # Where a number of an axis is known by itself, its companion is held, and it follows.
    alone = (known | contradicted).reshape(2, 3).any(axis=0)
    free = known | contradicted | np.tile(_combination_known(P, prior) & ~alone, 2)
    values, covariance, contradiction = _held(x, P, free, k)
    values, covariance, directions = _in_known_directions(values, covariance, free, k, prior)
    worth = improvement(calibration, k, values)
    flags = [tuple(bool(f) for f in which) for which in (free, known)]
    held = int(np.sum(~free))
    return Determined(
        six=SixParameters(vector3(values[:3]), vector3(values[3:])),
        free=_flags(flags[0]),
        known=_flags(flags[1]),
        directions=directions,
        sigma=_six(np.sqrt(np.maximum(np.diag(covariance), 0.0))),
        change=worth.change,
        error_before=worth.error_before,
        error_after=worth.error_after,
        probability=worth.probability,
        contradiction=contradiction,
        contradiction_limit=CHI_SQUARE_999[held],
    )


def flown_loads(batches: Sequence[Batch]) -> tuple[Vector3, Vector3]:
    """Means of the raw samples of some flight and of their squares, sensor axes, m/s^2 (squared).

    Those of level rest where nothing is kept (sums of before a restart).
    """
    raw = [b.segment.raw_s for b in batches]
    if not raw:
        return LEVEL_LOADS
    count = sum(len(r) for r in raw)
    first = np.sum([r.sum(axis=0) for r in raw], axis=0) / count
    second = np.sum([np.einsum("ij,ij->j", r, r) for r in raw], axis=0) / count
    return vector3(first), vector3(second)


def force_moments(
    mean: Sequence[float], square: Sequence[float], six: Sequence[float] | Array
) -> Array:
    """Second moments (6, 6) of what an error of the six does to the force, over a flight.

    With ``f = s (raw - o)`` an error (ds, do) of an axis gives ``ds (raw - o) - s do``.

    Args:
        mean: (3,) of the raw samples, sensor axes, m/s^2.
        square: (3,) of their squares.
        six: (6,) scale (1) and offset (m/s^2) about which it is taken.
    """
    M = np.zeros((6, 6))
    for j in range(3):
        s, o, first, second = six[j], six[3 + j], mean[j], square[j]
        M[j, j] = second - 2.0 * o * first + o * o
        M[j, 3 + j] = M[3 + j, j] = -s * (first - o)
        M[3 + j, 3 + j] = s * s
    return M


def _checked(x: Array, P: Array) -> tuple[Array, Array]:
    """Both, if ``P`` is a covariance.

    Raises:
        ValueError: it is not finite, symmetric and positive definite.
    """
    if P.shape != (6, 6) or not np.all(np.isfinite(P)) or not np.all(np.isfinite(x)):
        raise ValueError("estimate or covariance is not finite")
    diagonal = np.diag(P)
    if np.any(diagonal <= 0.0) or not np.allclose(P, P.T, rtol=1e-6, atol=0.0):
        raise ValueError("covariance is not symmetric with a positive diagonal")
    unit = np.sqrt(diagonal)  # scales and offsets differ by orders of magnitude: normalise
    if np.linalg.eigvalsh(P / np.outer(unit, unit))[0] <= 0.0:
        raise ValueError("covariance is not positive definite")
    return x, P


def _combination_known(P: Array, prior: Array) -> NDArray[np.bool_]:
    """(3,) whether some combination of scale and offset of an axis is known."""
    out = np.zeros(3, dtype=bool)
    for j in range(3):
        pair = np.array([j, 3 + j])
        ratio = P[np.ix_(pair, pair)] / np.outer(prior[pair], prior[pair])
        out[j] = np.linalg.eigvalsh(ratio)[0] <= PRIOR_SHARE**2
    return out


def _held(x: Array, P: Array, free: NDArray[np.bool_], k: Array) -> tuple[Array, Array, float]:
    """Values, covariance (zero where held) and contradiction, given that the rest is ``k``."""
    f, h = np.flatnonzero(free), np.flatnonzero(~free)
    values, covariance = k.copy(), np.zeros((6, 6))
    if not h.size:
        return x.copy(), P.copy(), 0.0
    unit = np.sqrt(np.diag(P))
    C = P / np.outer(unit, unit)
    shift = (k[h] - x[h]) / unit[h]
    gain = np.linalg.solve(C[np.ix_(h, h)], C[np.ix_(h, f)]).T
    values[f] = x[f] + unit[f] * (gain @ shift)
    left = C[np.ix_(f, f)] - gain @ C[np.ix_(h, f)]
    covariance[np.ix_(f, f)] = np.outer(unit[f], unit[f]) * (left + left.T) / 2.0
    return values, covariance, float(shift @ np.linalg.solve(C[np.ix_(h, h)], shift))


def _in_known_directions(
    values: Array, covariance: Array, free: NDArray[np.bool_], k: Array, prior: Array
) -> tuple[Array, Array, int]:
    """Values that leave ``k`` only in directions that are known, their covariance, how many."""
    f = np.flatnonzero(free)
    out, sigma = k.copy(), np.zeros((6, 6))
    if not f.size:
        return out, sigma, 0
    unit = prior[f]
    ratio, V = np.linalg.eigh(covariance[np.ix_(f, f)] / np.outer(unit, unit))
    off = V.T @ ((values - k)[f] / unit)
    good = (ratio <= PRIOR_SHARE**2) | (off**2 > CHI_SQUARE_999[1] * ratio)
    if np.all(good):  # nothing is left out: no rounding either
        return values, covariance, len(f)
    V = V[:, good]
    out[f] = k[f] + unit * (V @ off[good])
    sigma[np.ix_(f, f)] = np.outer(unit, unit) * (V @ np.diag(ratio[good]) @ V.T)
    return out, sigma, int(np.sum(good))


def _error(off: Array, M: Array, P: Array) -> float:
    """Expected error of the force, root mean square, of values that are ``off`` the estimate."""
    return math.sqrt(max(float(off @ M @ off + np.sum(M * P)), 0.0))


def _six(values: Array) -> Six:
    a, b, c, d, e, f = (float(v) for v in values)
    return a, b, c, d, e, f


def _flags(values: Sequence[bool]) -> SixFlags:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f
