"""Errors of velocity and attitude over a whole flight: a fixed-interval smoother.

The state is the error of what the inertial samples and the recorded attitude alone would give:
velocity (NED, m/s), attitude (NED rotation vector, rad) and bias of the gyroscope (body, rad/s).
The gyroscope carries the attitude; what the recorded one turns beyond that is its own error, and
is taken off.  H. E. Rauch, F. Tung and C. T. Striebel, AIAA Journal 3 (1965).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew

V, PSI, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)
HEADING: Final = 5
STATES: Final = 9
START_M_S, START_RAD_S = 1.0, 0.01
"""Standard deviations of velocity and bias at the beginning [physics]."""
BIAS_WALK: Final = 2e-5
"""Wander of a gyroscope's bias, rad/s per sqrt(s) [data sheet]."""
LOOSE_RAD: Final = 0.25
"""What the recorded attitude is believed to at each fix, rad: two degrees over ten seconds, so that
a heading that nothing shows does not wander off [physics]."""
NOT_RAD: Final = 1e3
"""The same of one that is not believed again [cost]."""
FORCE_WALK: Final = 0.01
"""Noise of the specific force, m/s^2 per sqrt(Hz) [data sheet]."""


@dataclass(frozen=True, slots=True)
class Steps:
    """From one fix to the next, n fixes.

    Attributes:
        dt: (n,) s since the fix before; the first is 0.
        impulse: (n, 3) integral of the specific force in NED since then, m/s.
        turned: (n, 3) what the recorded attitude turned beyond the gyroscope, NED, rad.
        R_nb: (n, 3, 3) recorded attitude there.
        measured: (n, 3) velocity by the receiver less the integral, m/s; NaN where there is none.
    """

    dt: Array
    impulse: Array
    turned: Array
    R_nb: Array
    measured: Array

    def until(self, k: int) -> Steps:
        """The first k."""
        return Steps(
            self.dt[:k], self.impulse[:k], self.turned[:k], self.R_nb[:k], self.measured[:k]
        )


@dataclass(frozen=True, slots=True)
class Levels:
    """Noise.

    Attributes:
        attitude: of the gyroscope's attitude, rad per sqrt(s).
        velocity: of the receiver's velocity, m/s.
        recorded: what the recorded attitude is believed to at each fix, rad.
    """

    attitude: float
    velocity: float
    recorded: float = LOOSE_RAD


@dataclass(frozen=True, slots=True)
class Smoothed:
    """(n, 9) errors at the fixes, and their variances there."""

    x: Array
    variance: Array

    @property
    def sigma(self) -> Array:
        """(9,) mean standard deviations."""
        out: Array = np.sqrt(np.maximum(np.mean(self.variance, axis=0), 0.0))
        return out


@dataclass(frozen=True, slots=True)
class _Filtered:
    means: Array
    covariances: Array
    ahead_means: Array
    ahead_covariances: Array
    moves: Array


def likelihoods(steps: Steps, levels: Sequence[Levels], attitude: Array) -> Array:
    """(j,) logarithm of the likelihood of what was measured, by each of the levels at once.

    ``attitude`` as in :func:`smoothed`.
    """
    j, n = len(levels), len(steps.dt)
    m, P, score = np.zeros((j, STATES)), np.tile(_start(attitude), (j, 1, 1)), np.zeros(j)
    first = np.flatnonzero(np.isfinite(steps.measured).all(axis=1))
    if len(first):
        m[:, V] = steps.measured[first[0]]
    rates = np.array([_rate(its) for its in levels])
    R_measured = np.array([_noise(its) for its in levels])
    moves, kicks = _moves(steps)
    diagonal = np.arange(STATES)
    for k in range(n):
        A = moves[k]
        m = m @ A.T + kicks[k]
        P = A @ P @ A.T
        P[:, diagonal, diagonal] += rates * steps.dt[k]
        rows = _seen(steps.measured[k])
        y = np.concatenate([steps.measured[k], np.zeros(3)])[rows]
        S = P[:, rows][:, :, rows] + R_measured[:, rows][:, :, rows]
        inverse = np.linalg.inv(S)
        e = y - m[:, rows]
        gain = P[:, :, rows] @ inverse
        m = m + np.einsum("jab,jb->ja", gain, e)
        P = P - gain @ P[:, rows]
        P = 0.5 * (P + np.swapaxes(P, 1, 2))
        score -= 0.5 * (np.einsum("ja,jab,jb->j", e, inverse, e) + np.linalg.slogdet(S)[1])
    return score


def smoothed(steps: Steps, levels: Levels, attitude: Array) -> Smoothed:
    """Errors by everything that was measured before and after.

    Args:
        steps: from fix to fix.
        levels: of the noise.
        attitude: (3,) how well the recorded one is known at the beginning, about north, east and
            down, rad.
    """
    f = _filtered(steps, levels, _start(attitude))
    n = len(steps.dt)
    x, P = f.means.copy(), f.covariances[-1]
    variance = np.empty((n, STATES))
    variance[-1] = np.diag(P)
    for k in range(n - 2, -1, -1):
        gain = np.linalg.solve(f.ahead_covariances[k + 1], f.moves[k + 1] @ f.covariances[k]).T
        x[k] = f.means[k] + gain @ (x[k + 1] - f.ahead_means[k + 1])
        P = f.covariances[k] + gain @ (P - f.ahead_covariances[k + 1]) @ gain.T
        variance[k] = np.diag(P)
    return Smoothed(x, variance)


def attitude_known(steps: Steps, levels: Levels, attitude: Array) -> tuple[Array, Array]:
    """How well the attitude is known; arguments as of :func:`smoothed`.

    By the motion, or as well as at the beginning: what the recorded one is off by all flight long,
    or more and more, is off at every fix, and asking it again and again tells nothing.

    Returns:
        (3,) on the whole, rad, and (n,) variance of the heading by the motion alone, rad^2.
    """
    by_motion = smoothed(steps, replace(levels, recorded=NOT_RAD), attitude)
    return np.minimum(by_motion.sigma[PSI], attitude), by_motion.variance[:, HEADING]


def _start(attitude: Array) -> Array:
    """(9, 9) covariance at the beginning."""
    sigma = np.concatenate([np.full(3, START_M_S), attitude, np.full(3, START_RAD_S)])
    return np.diag(sigma**2)


def _rate(levels: Levels) -> Array:
    """(9,) growth of the variances by time."""
    return np.array([FORCE_WALK**2] * 3 + [levels.attitude**2] * 3 + [BIAS_WALK**2] * 3)


def _noise(levels: Levels) -> Array:
    """(6, 6) covariance of velocity and attitude as they are measured."""
    return np.diag([levels.velocity**2] * 3 + [levels.recorded**2] * 3)


def _seen(measured: Array) -> NDArray[np.intp]:
    """Which of velocity (3) and attitude (3) is measured."""
    return np.flatnonzero(np.isfinite(np.concatenate([measured, np.zeros(3)])))


def _moves(steps: Steps) -> tuple[Array, Array]:
    """(n, 9, 9) how the errors go on from fix to fix, and (n, 9) what is added to them."""
    n = len(steps.dt)
    crosses = skew(steps.impulse)
    moves, kicks = np.tile(np.eye(STATES), (n, 1, 1)), np.zeros((n, STATES))
    moves[:, V, PSI] = -crosses
    moves[:, PSI, BIAS] = -steps.dt[:, None, None] * steps.R_nb
    # Half of a step's turning acts on the velocity of the same step.
    moves[:, V, BIAS] = 0.5 * steps.dt[:, None, None] * crosses @ steps.R_nb
    kicks[:, PSI] = -steps.turned
    kicks[:, V] = 0.5 * np.einsum("nij,nj->ni", crosses, steps.turned)
    return moves, kicks


def _filtered(steps: Steps, levels: Levels, start: Array) -> _Filtered:
    n = len(steps.dt)
    m, P = np.zeros(STATES), start
    first = np.flatnonzero(np.isfinite(steps.measured).all(axis=1))
    if len(first):
        m[V] = steps.measured[first[0]]
    means, ahead_means = np.empty((n, STATES)), np.empty((n, STATES))
    covariances, ahead = (np.empty((n, STATES, STATES)) for _ in range(2))
    moves, kicks = _moves(steps)
    rate, R_measured = _rate(levels), _noise(levels)
    diagonal = np.arange(STATES)
    for k in range(n):
        A = moves[k]
        m = A @ m + kicks[k]
        P = A @ P @ A.T
        P[diagonal, diagonal] += rate * steps.dt[k]
        ahead_means[k], ahead[k] = m, P
        seen = _seen(steps.measured[k])
        y = np.concatenate([steps.measured[k], np.zeros(3)])[seen]
        S = P[np.ix_(seen, seen)] + R_measured[np.ix_(seen, seen)]
        gain = np.linalg.solve(S, P[seen]).T
        m = m + gain @ (y - m[seen])
        P = P - gain @ P[seen]
        P = 0.5 * (P + P.T)
        means[k], covariances[k] = m, P
    return _Filtered(means, covariances, ahead_means, ahead, moves)
