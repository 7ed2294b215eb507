"""What a receiver that averages over a span does to the velocity it reports.

A receiver whose velocity is the mean over ``window`` seconds centred on the epoch reports
``V + (window^2 / 24) V'' + ...``.  Everything that is needed of the exact mean are differences of
the velocity ``V`` and of the place ``X``, its integral: ``mean(V) = (X(t + window/2) -
X(t - window/2)) / window``.  So a force is integrated twice, once for a whole segment, and asked
at two places of an epoch instead of at all samples around it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain

RESOLVED_S = 0.125
"""s; over a shorter span the slope of a force is mostly vibration."""
SPREAD = math.sqrt(12.0)
"""A span over the standard deviation of what is in it evenly."""


def weight_of_two(window: float, apart: float) -> float:
    """Weight, up to a half, of one of two moments that spread like ``window``, both s.

    As far ``apart`` they do so with this weight of either; where even halves spread too little,
    they are further apart.
    """
    spread = window / SPREAD / max(apart, 1e-9)
    return 0.5 - math.sqrt(max(0.25 - spread**2, 0.0))


def between_two(window: float, older: float) -> float:
    """How far apart two moments are, s, that spread like ``window`` with this weight of either."""
    return window / SPREAD / math.sqrt(older * (1.0 - older))


class Gained:
    """An acceleration, straight lines between equidistant nodes, integrated twice and exactly.

    Vibration that the nodes resolve is cancelled, whatever the span.
    """

    __slots__ = ("_a", "_late", "_start", "_step", "_v", "_x")

    def __init__(self, start: float, step: float, a: Array) -> None:
        """Take ``a`` (n, 3), m/s^2, axes that do not turn, at ``start + i step``, s; n >= 2."""
        self._a = plain(a)
        self._v, self._x = v, x = np.zeros_like(self._a), np.zeros_like(self._a)
        self._start, self._step = start, step
        self._late: tuple[float, Array] | None = None
        loops = compiled_loops()
        if loops is not None:
            loops.twice(step, self._a, v, x)
            return
        np.cumsum(0.5 * step * (a[:-1] + a[1:]), axis=0, out=v[1:])
        x[1:] = np.cumsum(step * v[:-1] + step**2 / 6.0 * (2.0 * a[:-1] + a[1:]), axis=0)

    def moments(self, t: Array, shifts: Sequence[float] = (0.0,)) -> tuple[Array, Array]:
        """Velocity, m/s, and place, m, at ``t + shift`` for each of S shifts (s): (S, k, 3) each.

        All at once: of a dozen moments about an epoch each would cost a call of its own.
        """
        at = (t + np.array(shifts)[:, None]).ravel()
        loops = compiled_loops()
        if loops is None:
            i, s, a, slope = self._since_node(at)
            velocity = self._v[i] + s * (a + 0.5 * s * slope)
            place = self._x[i] + s * (self._v[i] + s * (0.5 * a + s / 6.0 * slope))
        else:
            velocity, place = np.empty((len(at), 3)), np.empty((len(at), 3))
            loops.gained(self._start, self._step, self._a, self._v, self._x, at, velocity, place)
        shape = len(shifts), len(t), 3
        return velocity.reshape(shape), place.reshape(shape)

    def _since_node(self, t: Array) -> tuple[NDArray[np.intp], Array, Array, Array]:
        """The node before times ``t`` (k,), s since then (k, 1), the force there and its slope."""
        since = t - self._start
        i = np.clip((since / self._step).astype(int), 0, len(self._a) - 2)
        s = (since - i * self._step)[:, None]
        a = self._a[i]
        return i, s, a, (self._a[i + 1] - a) / self._step

    def velocity(self, t: Array) -> Array:
        """(k, 3) gained since the first node until times ``t`` (k,), m/s."""
        velocity: Array = self.moments(t)[0][0]
        return velocity

    def mean(self, t: Array, width: float) -> Array:
        """Mean of the force over ``width`` (s) about times ``t`` (k,): (k, 3), m/s^2.

        The derivative of a receiver's averaged velocity: ``d/dt mean(V) = mean(a)``.  The
        acceleration *at* that moment is mostly vibration, which an averaged velocity does not have:
        as a regressor of the latency it would be noise.  No span is shorter than two nodes.
        """
        half = 0.5 * max(width, self._step)
        after, before = self.moments(t, (half, -half))[0]
        out: Array = (after - before) / (2.0 * half)
        return out

    def averaged(self, t: Array, window: float) -> Array:
        """``mean(V) - V`` for a span of ``window``, s, about times ``t`` (k,): (k, 3), m/s."""
        if window <= 0.0:
            return np.zeros((len(t), 3))
        # Between two nodes it goes with the square of the span, and rounding does not.
        half = 0.5 * max(window, self._step)
        velocity, place = self.moments(t, (0.0, half, -half))
        mean = (place[1] - place[2]) / (2.0 * half)
        out: Array = (mean - velocity[0]) * (window / (2.0 * half)) ** 2
        return out

    def averaged_place(self, t: Array, window: float) -> Array:
        """``mean(X) - X`` for a span of ``window``, s, about times ``t`` (k,): (k, 3), m.

        Simpson's rule, exact for cubics: the force within the span counts as the mean of its place
        weighs it.  That *at* the epoch is mostly vibration; times the span squared it would be a
        noise of the height that goes with the force, and so a scale.
        """
        half = 0.5 * window
        now, after, before = self.moments(t, (0.0, half, -half))[1]
        out: Array = (after + before - 2.0 * now) / 6.0
        return out

    def paired(self, t: Array, window: float, older: Sequence[float] = (0.5,)) -> Array:
        """``mean(V) - V`` of two moments that spread like ``window``, s: (S, k, 3), m/s.

        Args:
            t: (k,) s, where the mean of the two is.
            window: s.
            older: S weights of the older one, between 0 and 1.
        """
        apart = [between_two(window, weight) for weight in older]
        newest = [weight * a for weight, a in zip(older, apart, strict=True)]
        oldest = [(weight - 1.0) * a for weight, a in zip(older, apart, strict=True)]
        velocity = self.moments(t, (0.0, *newest, *oldest))[0]
        weight = np.array(older)[:, None, None]
        new, old = velocity[1 : 1 + len(older)], velocity[1 + len(older) :]
        out: Array = (1.0 - weight) * new + weight * old - velocity[0]
        return out

    def lagged(self, t: Array, window: float) -> Array:
        """``lag(V) - V`` of a first-order lag that spreads like ``window``, s: (k, 3), m/s.

        Its time constant is its spread and its delay, which counts as latency: it is looked at so
        much later.  A lagged velocity is ``V`` less the time constant times the lagged force.
        """
        lag = window / SPREAD
        if lag <= 0.0:
            return np.zeros((len(t), 3))
        i, s, a, slope = self._since_node(t + lag)
        kept = np.exp(-s / lag)
        force = kept * self._lagged_force(lag)[i] + (1.0 - kept) * (a - lag * slope) + slope * s
        now, later = self.moments(t, (0.0, lag))[0]
        out: Array = later - lag * force - now
        return out

    def _lagged_force(self, lag: float) -> Array:
        """(n, 3) the force at the nodes behind a first-order lag, s; it began as its mean was."""
        if self._late is not None and self._late[0] == lag:
            return self._late[1]
        a, x = self._a, self._step / lag
        kept = np.exp(-x)
        share = (1.0 - kept) / x  # straight lines between nodes: exact
        z = np.empty_like(a)
        z[0] = a[: int(1.0 / x) + 1].mean(axis=0)
        z[1:] = (share - kept) * a[:-1] + (1.0 - share) * a[1:]
        # What one node keeps of the one before, two keep squared: doubled until nothing is left.
        k = 1
        while k < len(z) and kept**k > np.finfo(float).eps:
            z[k:] += kept**k * z[:-k]  # numpy copies what overlaps
            k *= 2
        self._late = lag, z
        return z

    def slope(self, t: Array, window: float, longest: float) -> Array:
        """Derivative of :meth:`averaged` to ``window^2``; the limit ``V'' / 24`` at zero.

        Args:
            t: (k,) s.
            window: s.
            longest: span that the nodes allow, s.

        Returns:
            (k, 3) m/s^3.
        """
        # The effect of a shorter span is the second derivative, whose best estimate is that over
        # one which is resolved.
        if window < RESOLVED_S:
            limit: Array = self.averaged(t, RESOLVED_S) / RESOLVED_S**2
            return limit
        high, low = min(1.02 * window, longest), 0.98 * window
        out: Array = (self.averaged(t, high) - self.averaged(t, low)) / (high**2 - low**2)
        return out
