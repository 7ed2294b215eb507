"""How the wind of a flight wanders: size and time of its slow part, by likelihood.

Noise of the force has the axes of the body and a memory of ten seconds at the most.  Air that
wanders for longer is taken for a part of the constant wind then, with a sigma that knows nothing of
it.  Here it is a process of its own over ground, whose two numbers are the likeliest with the
wind, all other unknowns and its own course integrated out (marginal likelihood; C. E. Rasmussen and
C. K. I. Williams, *Gaussian Processes for Machine Learning*, 2006, section 2.7).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.slow_wind import Wander, covariance_of, may_wander, nodes_of
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.limits import RECEIVER_M_S
from onboard.core.vehicle.noise import AxisNoise, fitted_noise, log_spread, whitened
from onboard.core.vehicle.windows import Windows, windows_of

TIMES_S = (12.0, 20.0, 35.0, 60.0, 120.0)
"""s of correlation that are tried: from where the noise's own end to the gap in the spectrum of the
wind near the ground, at several minutes (I. van der Hoven, 1957) [physics]."""
SIZES_M_S = (0.05, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65, 0.9, 1.3, 1.9)
"""m/s of a component that are tried [cost]."""
PLAUSIBLE_M_S = 0.7
"""Before the flight, the standard deviation about none of such a size, m/s: a component of gusts is
a tenth to a fifth of the wind at six metres (MIL-F-8785C, 1980, section 3.7.3.4) [physics]."""
BEGIN = Wander(0.5, 30.0)
"""What is taken out of the force before its noise is found anew, for the first time [cost]."""
TURNS = 3
"""Times that noise and wander are found in turn [cost]."""


@dataclass(frozen=True, slots=True)
class _Rows:
    """Means over windows (r, k, ...): what a fit leaves, its slopes by unknowns and by nodes."""

    fit: Fit
    windows: Windows
    nodes: Array
    residual: Array
    slopes: Array
    sensitivity: Array

    @classmethod
    def of(cls, fit: Fit) -> _Rows:
        """Those of a fit."""
        flight, windows = fit.model.flight, windows_of(fit.model.flight)
        nodes = nodes_of(flight)
        unit = np.eye(len(nodes))
        hats = np.stack([np.interp(flight.t, nodes, row) for row in unit], axis=1)
        by_wind = fit.model.gust_slope(fit.theta)
        slow = [by_wind[:, :, way, None] * hats[:, None, :] for way in (0, 1)]
        slopes = np.concatenate([fit.jacobian, *slow], axis=2)
        rows = (windows.mean(x) for x in (fit.residual, slopes, fit.sensitivity))
        return cls(fit, windows, nodes, *rows)

    def sums(self, noise: Sequence[AxisNoise]) -> tuple[Array, Array, float]:
        """Sums by a noise: (m, m), (m,), and twice the negative log-likelihood of the rest."""
        m = self.slopes.shape[2]
        N, b, rest = np.zeros((m, m)), np.zeros(m), 0.0
        w = self.windows
        for k, its in enumerate(noise):
            rows = np.column_stack([self.residual[:, k], self.slopes[:, k]])
            sensitive = self.sensitivity[:, k]
            made = whitened(rows, its, sensitive, w.piece, w.length_s)
            y, h = made[:, 0], made[:, 1:]
            N, b = N + h.T @ h, b + h.T @ y
            rest += float(y @ y) + 2.0 * log_spread(its, sensitive, w.length_s)
        return N, b, rest

    def left(self, x: Array) -> Array:
        """(r, k) what is left with the unknowns so much further."""
        out: Array = self.residual - self.slopes @ x
        return out

    def noise(self, x: Array) -> tuple[AxisNoise, ...]:
        """The likeliest of what is left."""
        w, left = self.windows, self.left(x)
        return tuple(
            fitted_noise(left[:, k], self.sensitivity[:, k], w.piece, w.length_s, gusts=True)
            for k in range(left.shape[1])
        )


@dataclass(frozen=True, slots=True)
class _Trial:
    """A wander, twice its negative log-likelihood, and (m,) the likeliest unknowns with it."""

    wander: Wander
    deviance: float
    x: Array


def wander_of(fit: Fit) -> Wander | None:
    """The slow part of the wind of a single flight; None where it is what errors look like.

    Args:
        fit: of everything else, with regressors that are not told from the past.
    """
    if not may_wander(fit.model.flight):
        return None
    rows = _Rows.of(fit)
    best = _best(rows, fit.noise)
    noise = rows.noise(_tried(rows, rows.sums(fit.noise), BEGIN).x)
    for _ in range(TURNS):
        now = _best(rows, noise)
        if now.deviance < best.deviance:
            best = now
        noise = rows.noise(now.x)
    return best.wander if best.wander.rms > RECEIVER_M_S else None


def _best(rows: _Rows, noise: Sequence[AxisNoise]) -> _Trial:
    """What all that are tried come to by a noise, each as likely as it is.

    A minute's size is hardly told from a larger one of two minutes: the mean of the variances is
    what is known of it.
    """
    sums = rows.sums(noise)
    wanders = [Wander(*both) for both in itertools.product(SIZES_M_S, TIMES_S)]
    cost = np.array(
        [_tried(rows, sums, w).deviance + (w.rms / PLAUSIBLE_M_S) ** 2 for w in wanders]
    )
    weight = np.exp(-0.5 * (cost - np.min(cost)))
    weight /= np.sum(weight)
    square = float(weight @ np.array([w.rms**2 for w in wanders]))
    time = float(weight @ np.log([w.time_s for w in wanders]))
    return _tried(rows, sums, Wander(math.sqrt(square), math.exp(time)))


def _tried(rows: _Rows, sums: tuple[Array, Array, float], wander: Wander) -> _Trial:
    """How likely a wander is, with all unknowns integrated out."""
    N, b, rest = sums
    fit, m = rows.fit, len(rows.fit.theta)
    one = np.linalg.inv(covariance_of(rows.nodes, wander))
    P, count = np.zeros_like(N), len(one)
    P[:m, :m] = np.diag(fit.prior)
    P[m : m + count, m : m + count] = P[m + count :, m + count :] = one
    apart = np.zeros(len(b))
    apart[:m] = fit.model.nominal - fit.theta
    whole, towards = N + P, b + P @ apart
    x = np.asarray(np.linalg.solve(whole, towards), dtype=np.float64)
    chance = np.linalg.slogdet(whole)[1] - np.linalg.slogdet(P)[1]
    deviance = rest + float(apart @ P @ apart) - float(towards @ x) + float(chance)
    return _Trial(wander, deviance, x)
