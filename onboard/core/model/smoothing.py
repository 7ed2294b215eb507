"""What a receiver that averages over a span does to the velocity it reports.

A receiver whose velocity is the mean over ``window`` seconds centred on the epoch reports
``V + (window^2 / 24) V'' + ...``.  Everything that is needed of the exact mean are differences of
the velocity ``V`` and of the place ``X``, its integral: ``mean(V) = (X(t + window/2) -
X(t - window/2)) / window``.  So a force is integrated twice, once for a whole segment, and asked
at two places of an epoch instead of at all samples around it.  Whatever else a receiver does is
such a sum, too (:data:`Combination`), so that all of it is looked up at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, chain
from typing import TypeAlias

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
    weight = 0.5 - math.sqrt(max(0.25 - spread**2, 0.0))
    return weight if 1.0 - weight < 1.0 else 0.0  # what rounding loses is no moment


def between_two(window: float, older: float) -> float:
    """How far apart two moments are, s, that spread like ``window`` with this weight of either."""
    return window / SPREAD / math.sqrt(older * (1.0 - older))


def lag_of(window: float) -> float:
    """Time constant, s, of a first-order lag that spreads like ``window``, s."""
    return window / SPREAD


Combination: TypeAlias = tuple[tuple[float, float, float, float], ...]
"""A sum of what is at moments about an epoch: shift of each, s, and weights there of the velocity,
of the place (1/s) and of the force behind a lag (s).  Two, one behind the other, add up."""
NOW: Combination = ((0.0, 1.0, 0.0, 0.0),)
"""The velocity at the epoch itself."""


def mean(width: float, step: float) -> Combination:
    """The mean of the force over ``width``, s, m/s^2; over no less than a ``step`` of nodes, s.

    The derivative of a receiver's averaged velocity: ``d/dt mean(V) = mean(a)``.  The acceleration
    *at* that moment is mostly vibration, which an averaged velocity does not have: as a regressor
    of the latency it would be noise.
    """
    return change(NOW, 0.5 * max(width, step))


def averaged(window: float, step: float) -> Combination:
    """``mean(V) - V`` for a span of ``window``, s, m/s; the nodes are a ``step`` apart, s."""
    if window <= 0.0:
        return ()
    # Between two nodes it goes with the square of the span, and rounding does not.
    half = 0.5 * max(window, step)
    less, share = (window / (2.0 * half)) ** 2, 0.5 / half
    ends = (half, 0.0, share, 0.0), (-half, 0.0, -share, 0.0)
    return times(less, ends + times(-1.0, NOW))


def averaged_place(window: float) -> Combination:
    """``mean(X) - X`` for a span of ``window``, s, m.

    Simpson's rule, exact for cubics: the force within the span counts as the mean of its place
    weighs it.  That *at* the epoch is mostly vibration; times the span squared it would be a noise
    of the height that goes with the force, and so a scale.
    """
    half = 0.5 * window
    ends = (half, 0.0, 1.0 / 6.0, 0.0), (-half, 0.0, 1.0 / 6.0, 0.0)
    return (*ends, (0.0, 0.0, -1.0 / 3.0, 0.0))


def paired(window: float, older: float = 0.5) -> Combination:
    """``mean(V) - V`` of two moments that spread like ``window``, s, and have their mean now, m/s.

    Args:
        window: s.
        older: weight of the older one, between 0 and 1.
    """
    apart = between_two(window, older)
    newest, oldest = older * apart, (older - 1.0) * apart
    both = (newest, 1.0 - older, 0.0, 0.0), (oldest, older, 0.0, 0.0)
    return both + times(-1.0, NOW)


def paired_place(window: float, older: float) -> Combination:
    """``mean(X) - X`` of the moments of :func:`paired`, m."""
    return tuple((shift, 0.0, weight, 0.0) for shift, weight, _, _ in paired(window, older))


def lagged(window: float) -> Combination:
    """``lag(V) - V`` of a first-order lag that spreads like ``window``, s, m/s.

    Its time constant (:func:`lag_of`) is its spread and its delay, which counts as latency: it is
    looked at so much later.  A lagged velocity is ``V`` less the time constant times the lagged
    force.
    """
    lag = lag_of(window)
    return () if lag <= 0.0 else ((lag, 1.0, 0.0, -lag), *times(-1.0, NOW))


def lagged_place(window: float) -> Combination:
    """``lag(X) - X`` of the lag of :func:`lagged`, m: ``X`` less the time constant times its V."""
    lag = lag_of(window)
    return () if lag <= 0.0 else ((lag, -lag, 1.0, lag**2), (0.0, 0.0, -1.0, 0.0))


def slope(window: float, longest: float, step: float) -> Combination:
    """Derivative of :func:`averaged` to ``window^2``, m/s^3; the limit ``V'' / 24`` at zero.

    Args:
        window: s.
        longest: span that the nodes allow, s.
        step: from node to node, s.
    """
    # The effect of a shorter span is the second derivative, whose best estimate is that over
    # one which is resolved.
    if window < RESOLVED_S:
        return times(RESOLVED_S**-2, averaged(RESOLVED_S, step))
    high, low = min(1.02 * window, longest), 0.98 * window
    share = 1.0 / (high**2 - low**2)
    return times(share, averaged(high, step)) + times(-share, averaged(low, step))


def times(weight: float, of: Combination) -> Combination:
    """A combination with all its weights multiplied."""
    return tuple((shift, weight * v, weight * x, weight * z) for shift, v, x, z in of)


def change(of: Combination, by: float) -> Combination:
    """What a combination changes by in time, 1/s, looked at ``by`` seconds to either side."""
    return tuple(
        (shift + side * by, side * v / (2.0 * by), side * x / (2.0 * by), side * z / (2.0 * by))
        for side in (1.0, -1.0)
        for shift, v, x, z in of
    )


class Gained:
    """An acceleration, straight lines between equidistant nodes, integrated twice and exactly.

    Vibration that the nodes resolve is cancelled, whatever the span.

    Attributes:
        step: from node to node, s.
    """

    __slots__ = ("_a", "_late", "_start", "_v", "_x", "step")

    def __init__(self, start: float, step: float, a: Array) -> None:
        """Take ``a`` (n, 3), m/s^2, axes that do not turn, at ``start + i step``, s; n >= 2."""
        self._a = plain(a)
        self._v, self._x = v, x = np.zeros_like(self._a), np.zeros_like(self._a)
        self._start, self.step = start, step
        self._late: tuple[float, Array] | None = None
        loops = compiled_loops()
        if loops is not None:
            loops.twice(step, self._a, v, x)
            return
        np.cumsum(0.5 * step * (a[:-1] + a[1:]), axis=0, out=v[1:])
        x[1:] = np.cumsum(step * v[:-1] + step**2 / 6.0 * (2.0 * a[:-1] + a[1:]), axis=0)

    def seen(self, t: Array, of: Sequence[Combination], window: float = 0.0) -> Array:
        """Combinations of what is about times ``t`` (k,), in one go: (S, k, 3) of S of them.

        Args:
            t: (k,) s.
            of: S combinations.
            window: s, whose :func:`lag_of` the force is behind where a lag is in them.
        """
        out = np.zeros((len(of), len(t), 3))
        ends = np.array(list(accumulate(map(len, of))))
        terms = np.array(list(chain.from_iterable(chain.from_iterable(of)))).reshape(-1, 4)
        lag = lag_of(window) if terms[:, 3].any() else 0.0
        late = self._lagged_force(lag) if lag > 0.0 else self._a
        loops = compiled_loops()
        if loops is not None:
            gained = self._start, self.step, self._a, self._v, self._x, late, lag
            loops.seen(*gained, plain(t), terms, ends, out)
            return out
        for i, one in enumerate(np.split(terms, ends[:-1])):
            for shift, of_velocity, of_place, of_force in one.tolist():
                at, s, a, along = self._since_node(t + shift)
                v = self._v[at]
                out[i] += of_velocity * (v + s * (a + 0.5 * s * along))
                if of_place:
                    out[i] += of_place * (self._x[at] + s * (v + s * (0.5 * a + s / 6.0 * along)))
                if of_force:
                    kept = np.exp(-s / lag)
                    behind = kept * late[at] + (1.0 - kept) * (a - lag * along) + along * s
                    out[i] += of_force * behind
        return out

    def _since_node(self, t: Array) -> tuple[NDArray[np.intp], Array, Array, Array]:
        """The node before times ``t`` (k,), s since then (k, 1), the force there and its slope."""
        since = t - self._start
        i = np.clip((since / self.step).astype(int), 0, len(self._a) - 2)
        s = (since - i * self.step)[:, None]
        a = self._a[i]
        return i, s, a, (self._a[i + 1] - a) / self.step

    def velocity(self, t: Array) -> Array:
        """(k, 3) gained since the first node until times ``t`` (k,), m/s."""
        velocity: Array = self.seen(t, [NOW])[0]
        return velocity

    def _lagged_force(self, lag: float) -> Array:
        """(n, 3) the force at the nodes behind a first-order lag, s; it began as its mean was."""
        if self._late is not None and self._late[0] == lag:
            return self._late[1]
        a, x = self._a, self.step / lag
        kept = math.exp(-x)
        share = (1.0 - kept) / x  # straight lines between nodes: exact
        z = np.empty_like(a)
        z[0] = a[: int(1.0 / x) + 1].mean(axis=0)
        loops = compiled_loops()
        if loops is not None:
            loops.late(kept, share, a, z)
            self._late = lag, z
            return z
        z[1:] = (share - kept) * a[:-1] + (1.0 - share) * a[1:]
        # What one node keeps of the one before, two keep squared: doubled until nothing is left.
        k = 1
        while k < len(z) and kept**k > np.finfo(float).eps:
            z[k:] += kept**k * z[:-k]  # numpy copies what overlaps
            k *= 2
        self._late = lag, z
        return z
