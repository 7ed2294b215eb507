"""Errors of velocity and attitude over a whole flight: a fixed-interval smoother.

The state is the error of what the inertial samples and the recorded attitude alone would give:
velocity (NED, m/s), attitude (NED rotation vector, rad) and bias of the gyroscope (body, rad/s).
The gyroscope carries the attitude; what the recorded one turns beyond that is its own error, and
is taken off.  H. E. Rauch, F. Tung and C. T. Striebel, AIAA Journal 3 (1965).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew

V, PSI, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)
STATES: Final = 9
START: Final = np.diag([1.0] * 3 + [0.03] * 3 + [0.01] * 3) ** 2
"""Standard deviations at the beginning: m/s, rad, rad/s [physics]."""
BIAS_WALK: Final = 2e-5
"""Wander of a gyroscope's bias, rad/s per sqrt(s) [data sheet]."""
LOOSE_RAD: Final = 0.25
"""What the recorded attitude is believed to at each fix, rad: two degrees over ten seconds, so that
a heading that nothing shows does not wander off [physics]."""
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
    """Noise: of the attitude (rad per sqrt(s)) and of the receiver's velocity (m/s)."""

    attitude: float
    velocity: float


@dataclass(frozen=True, slots=True)
class Smoothed:
    """(n, 9) errors at the fixes, and their mean standard deviations (9,)."""

    x: Array
    sigma: Array


@dataclass(frozen=True, slots=True)
class _Filtered:
    score: float
    means: Array
    covariances: Array
    ahead_means: Array
    ahead_covariances: Array
    moves: Array


def likelihood(steps: Steps, levels: Levels) -> float:
    """Logarithm of the likelihood of what was measured."""
    return _filtered(steps, levels).score


def smoothed(steps: Steps, levels: Levels) -> Smoothed:
    """Errors by everything that was measured before and after."""
    f = _filtered(steps, levels)
    n = len(steps.dt)
    x, P = f.means.copy(), f.covariances[-1]
    variance = np.diag(P).copy()
    for k in range(n - 2, -1, -1):
        gain = np.linalg.solve(f.ahead_covariances[k + 1], f.moves[k + 1] @ f.covariances[k]).T
        x[k] = f.means[k] + gain @ (x[k + 1] - f.ahead_means[k + 1])
        P = f.covariances[k] + gain @ (P - f.ahead_covariances[k + 1]) @ gain.T
        variance += np.diag(P)
    return Smoothed(x, np.sqrt(np.maximum(variance / n, 0.0)))


def _filtered(steps: Steps, levels: Levels) -> _Filtered:
    n = len(steps.dt)
    m, P, score = np.zeros(STATES), START.copy(), 0.0
    first = np.flatnonzero(np.isfinite(steps.measured).all(axis=1))
    if len(first):
        m[V] = steps.measured[first[0]]
    means, ahead_means = np.empty((n, STATES)), np.empty((n, STATES))
    covariances, ahead, moves = (np.empty((n, STATES, STATES)) for _ in range(3))
    crosses = skew(steps.impulse)
    rate = np.array([FORCE_WALK**2] * 3 + [levels.attitude**2] * 3 + [BIAS_WALK**2] * 3)
    R_measured = np.diag([levels.velocity**2] * 3 + [LOOSE_RAD**2] * 3)
    for k in range(n):
        h = steps.dt[k]
        A = np.eye(STATES)
        A[V, PSI] = -crosses[k]
        A[PSI, BIAS] = -h * steps.R_nb[k]
        # Half of a step's turning acts on the velocity of the same step.
        A[V, BIAS] = 0.5 * h * crosses[k] @ steps.R_nb[k]
        m = A @ m
        m[PSI] -= steps.turned[k]
        m[V] += 0.5 * crosses[k] @ steps.turned[k]
        P = A @ P @ A.T
        P[np.diag_indices(STATES)] += rate * h
        means[k], ahead_means[k], ahead[k], moves[k] = m, m, P, A
        y = np.concatenate([steps.measured[k], np.zeros(3)])
        seen = np.flatnonzero(np.isfinite(y))
        S = P[np.ix_(seen, seen)] + R_measured[np.ix_(seen, seen)]
        inverse = np.linalg.inv(S)
        e = y[seen] - m[seen]
        gain = P[:, seen] @ inverse
        m = m + gain @ e
        P = P - gain @ P[seen]
        P = 0.5 * (P + P.T)
        score -= 0.5 * (float(e @ inverse @ e) + float(np.linalg.slogdet(S)[1]))
        means[k], covariances[k] = m, P
    return _Filtered(score, means, covariances, ahead_means, ahead, moves)
