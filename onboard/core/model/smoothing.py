"""What a receiver that averages over a span does to the velocity it reports.

A receiver whose velocity is the mean over ``window`` seconds centred on the epoch reports
``V + (window^2 / 24) V'' + ...``.  Everything that is needed of the exact mean are differences of
the velocity ``V`` and of the place ``X``, its integral: ``mean(V) = (X(t + window/2) -
X(t - window/2)) / window``.  So a force is integrated twice, once for a whole segment, and asked
at two places of an epoch instead of at all samples around it.
"""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain

RESOLVED_S = 0.125
"""s; over a shorter span the slope of a force is mostly vibration."""
SECOND_DERIVATIVE_S = 0.12
"""s; to either side, over which a second derivative is taken, to whole pairs of nodes: shorter is
noise, longer misses a manoeuvre of 1 Hz [noisy flights tell 0.12 from 0.13 by up to 1.6 sigma]."""


class Gained:
    """An acceleration, straight lines between equidistant nodes, integrated twice and exactly.

    Vibration that the nodes resolve is cancelled, whatever the span.
    """

    __slots__ = ("_a", "_start", "_step", "_v", "_x")

    def __init__(self, start: float, step: float, a: Array) -> None:
        """Take ``a`` (n, 3), m/s^2, axes that do not turn, at ``start + i step``, s; n >= 2."""
        self._a = plain(a)
        self._v, self._x = v, x = np.zeros_like(self._a), np.zeros_like(self._a)
        self._start, self._step = start, step
        loops = compiled_loops()
        if loops is not None:
            loops.twice(step, self._a, v, x)
            return
        np.cumsum(0.5 * step * (a[:-1] + a[1:]), axis=0, out=v[1:])
        x[1:] = np.cumsum(step * v[:-1] + step**2 / 6.0 * (2.0 * a[:-1] + a[1:]), axis=0)

    def _gained(self, t: Array, shift: float) -> tuple[Array, Array]:
        """Velocity gained since the first node, m/s, and place, m, at ``t + shift``: (k, 3)."""
        loops = compiled_loops()
        if loops is not None:
            velocity, place = np.empty((len(t), 3)), np.empty((len(t), 3))
            nodes = self._start, self._step, self._a, self._v, self._x
            loops.gained(*nodes, plain(t), shift, velocity, place)
            return velocity, place
        since = t + shift - self._start
        i = np.clip((since / self._step).astype(int), 0, len(self._a) - 2)
        s = (since - i * self._step)[:, None]
        a, slope = self._a[i], (self._a[i + 1] - self._a[i]) / self._step
        velocity = self._v[i] + s * (a + 0.5 * s * slope)
        return velocity, self._x[i] + s * (self._v[i] + s * (0.5 * a + s / 6.0 * slope))

    def velocity(self, t: Array, shift: float = 0.0) -> Array:
        """(k, 3) gained since the first node until times ``t + shift`` (k,), m/s."""
        return self._gained(t, shift)[0]

    def place(self, t: Array, shift: float = 0.0) -> Array:
        """(k, 3) its integral, m."""
        return self._gained(t, shift)[1]

    def mean(self, t: Array, width: float) -> Array:
        """Mean of the force over ``width`` (s) about times ``t`` (k,): (k, 3), m/s^2.

        The derivative of a receiver's averaged velocity: ``d/dt mean(V) = mean(a)``.  The
        acceleration *at* that moment is mostly vibration, which an averaged velocity does not have:
        as a regressor of the latency it would be noise.  No span is shorter than two nodes.
        """
        half = 0.5 * max(width, self._step)
        out: Array = (self.velocity(t, half) - self.velocity(t, -half)) / (2.0 * half)
        return out

    def averaged(self, t: Array, window: float) -> Array:
        """``mean(V) - V`` for a span of ``window``, s, about times ``t`` (k,): (k, 3), m/s."""
        if window <= 0.0:
            return np.zeros((len(t), 3))
        # Between two nodes it goes with the square of the span, and rounding does not.
        half = 0.5 * max(window, self._step)
        mean = (self.place(t, half) - self.place(t, -half)) / (2.0 * half)
        out: Array = (mean - self.velocity(t)) * (window / (2.0 * half)) ** 2
        return out

    def averaged_place(self, t: Array, window: float) -> Array:
        """``mean(X) - X`` for a span of ``window``, s, about times ``t`` (k,): (k, 3), m.

        Simpson's rule, exact for cubics: the force within the span counts as the mean of its place
        weighs it.  That *at* the epoch is mostly vibration; times the span squared it would be a
        noise of the height that goes with the force, and so a scale.
        """
        half = 0.5 * window
        ends = self.place(t, half) + self.place(t, -half)
        out: Array = (ends - 2.0 * self.place(t)) / 6.0
        return out

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

    def second_derivative(self, t: Array, window: float, longest: float) -> Array:
        """Of the averaged force, over about 0.12 s to either side.

        Args:
            t: (k,) s.
            window: s, over which the force is averaged besides.
            longest: span that the nodes allow, s.

        Returns:
            (k, 3) m/s^4.
        """
        pair = 2.0 * self._step
        h = pair * max(1, round(SECOND_DERIVATIVE_S / pair))
        width = min(window, longest - 2.0 * h)
        before, now, after = (self.mean(t + s, width) for s in (-h, 0.0, h))
        out: Array = (before - 2.0 * now + after) / h**2
        return out
