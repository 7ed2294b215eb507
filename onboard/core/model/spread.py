"""What a receiver makes of the velocity that an acceleration beside the linearisation's gains.

The response of :mod:`~onboard.core.model.response` is that to the force by the calibration of the
linearisation.  An effect of the sensors adds a force of its own, and a receiver averages the
velocity that this gains no less: where it weighs what is ``tau`` from an epoch by ``h(tau)``, with
mean zero, it reports ``V`` and besides

    integral h(tau) (V(tau) - V(0)) dtau  =  integral a(s) k(s) ds,    k(s) = P(tau > s) - [s < 0].

Left out, a tilt of two degrees is found a twentieth too small behind a receiver that spreads over
0.34 s, and a third over 0.85 s, and scale and offset make up for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain
from onboard.core.model.quadrature import Signals
from onboard.core.model.smoothing import SPREAD, between_two, weight_of_two

TAIL = 12.0
"""Time constants after which nothing is left of a lag: 6e-6 [cost]."""
TOGETHER = 2**15
"""Numbers about some epochs that are looked up in one go: about all of a segment's they are
megabytes [cost]."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Weights of accelerations at n nodes in what a receiver reports at K epochs.

    Attributes:
        nodes: signals, S = (n,).
        R: (n, 3, 3) body axes at the nodes to those that do not turn.
        R_epoch: (K, 3, 3) those of the epochs to the same.
        at: (K, b) numbers of the nodes in a row about each epoch, some of which there may not be.
        velocity: (K, b) s, weights of these.
        place: (K, b) s^2.
    """

    nodes: Signals
    R: Array
    R_epoch: Array
    at: NDArray[np.intp]
    velocity: Array
    place: Array

    def add(self, acceleration: Array, columns: NDArray[np.intp], stack: Array) -> None:
        """Add what is reported beside velocity and place to columns of a stack.

        Args:
            acceleration: (n, 3, m) at the nodes, body axes, m/s^2 per unit.
            columns: (m,) of the stack.
            stack: (K, 9, ..) three vectors, body axes of the epochs, of which the first is of
                velocity and the second of place.
        """
        loops = compiled_loops()
        n, _, m = acceleration.shape
        K = len(self.at)
        if loops is not None:
            turns, first = (self.R, plain(self.R_epoch)), self.at[:, 0].copy()
            loops.spread(
                *turns, first, self.velocity, self.place, plain(acceleration), columns, stack
            )
            return
        there = np.clip(self.at, 0, n - 1)
        weights = np.where(there == self.at, np.stack((self.velocity, self.place)), 0.0)
        turned = (self.R @ acceleration).reshape(n, 3 * m)
        both, many = np.empty((K, 2, 3 * m)), max(1, TOGETHER // (there.shape[1] * 3 * m))
        for begin in range(0, K, many):
            part = slice(begin, begin + many)
            both[part] = weights.swapaxes(0, 1)[part] @ turned[there[part]]
        back = np.swapaxes(self.R_epoch, -1, -2)[:, None] @ both.reshape(K, 2, 3, m)
        stack[:, 0:6, columns] += back.reshape(K, 6, m)


def reaches(window: float, apart: float, h: Array) -> tuple[float, float]:
    """How far before and after an epoch a receiver looks, s: as of :func:`velocity_weights`."""
    both = max(window, apart)
    return both + (TAIL * window / SPREAD if h[-1] else 0.0), both


def nodes_within(reach: tuple[float, float], epoch: Array, step: float) -> NDArray[np.intp]:
    """(K, b) numbers of even nodes about epochs, some of which there may not be.

    Args:
        reach: before and after an epoch, s.
        epoch: (K,) counted in nodes.
        step: from node to node, s.
    """
    before, after = (int(r / step) + 2 for r in reach)
    return np.rint(epoch).astype(np.intp)[:, None] + np.arange(-before, after + 1)


def velocity_weights(since: Array, step: float, window: float, apart: float, h: Array) -> Array:
    """(K, n) s: integrals of ``k`` over the ``step`` (s) about each node.

    Args:
        since: (K, n) from the epoch to the node, s, in order.
        step: from node to node, s.
        window: span, s.
        apart: epochs, s.
        h: (4,) shares of the shapes beside the even mean.
    """
    shapes, loops = _shapes(window, apart, h), compiled_loops()
    out: Array = np.empty_like(since)
    if loops is not None:
        loops.averaging(plain(since), step, shapes, out)
        return out
    ends = np.concatenate([since - 0.5 * step, since[:, -1:] + 0.5 * step], axis=1)
    ahead = np.maximum(-ends, 0.0)
    # What of the integral is beyond either end of a step.
    beyond = np.zeros_like(ends)
    for share, *shape in shapes.tolist():
        beyond += share * (_beyond(shape, ends) - ahead)
    np.subtract(beyond[:, :-1], beyond[:, 1:], out=out)
    return out


def place_weights(since: Array, step: float, window: float, apart: float, h: Array) -> Array:
    """(K, n) s^2: those of the place, as of the force's.

    Of the even mean they are those of ``(X(window / 2) + X(-window / 2) - 2 X) / 6``.
    """
    out: Array = np.zeros_like(since)
    ahead = np.maximum(-since, 0.0)
    for share, *shape in _shapes(window, apart, h).tolist():
        if shape[0] == EVEN:
            out += share * np.maximum(0.5 * window - np.abs(since), 0.0) / 6.0
        else:
            out += share * (_beyond(shape, since) - ahead)
    out *= step
    return out


EVEN, TWO, LAGGED = 0.0, 1.0, 2.0
"""Kinds of responses: an even mean over a span (s); two moments, with the weight of the older one
and how far they are apart (s); a first-order lag of a time constant (s)."""


def _beyond(shape: Sequence[float], x: Array) -> Array:
    """``E max(tau - x, 0)`` of a response (kind, and what that asks for) beyond places x, s."""
    kind, a, b = shape
    if kind == EVEN:
        within = np.clip(0.5 * a - x, 0.0, a)
        even: Array = np.where(x < -0.5 * a, -x, within**2 / (2.0 * a))
        return even
    if kind == TWO:
        newest, oldest = np.maximum(a * b - x, 0.0), np.maximum((a - 1.0) * b - x, 0.0)
        two: Array = (1.0 - a) * newest + a * oldest
        return two
    before = np.maximum(a - x, 0.0)
    lagged: Array = before - a * (1.0 - np.exp(-before / a))
    return lagged


def _shapes(window: float, apart: float, h: Array) -> Array:
    """(S, 4) shares that add up to one (leaning to nothing), and the shapes that they are of."""
    less = weight_of_two(window, apart)
    if less <= 0.0:
        return np.array([(1.0, EVEN, window, 0.0)])
    newer, older, leaning, late = h.tolist()

    def two(share: float, weight: float) -> tuple[float, float, float, float]:
        return share, TWO, weight, between_two(window, weight)

    shapes = [
        (1.0 - newer - older - late, EVEN, window, 0.0),
        two(newer, less),
        two(older, 1.0 - less),
        two(0.5 * leaning, 0.25),
        two(-0.5 * leaning, 0.75),
        (late, LAGGED, window / SPREAD, 0.0),
    ]
    return np.array([shape for shape in shapes if shape[0]])
