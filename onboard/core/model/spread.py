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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain
from onboard.core.model.quadrature import Signals
from onboard.core.model.smoothing import SPREAD, between_two, weight_of_two

TAIL = 12.0
"""Time constants after which nothing is left of a lag: 6e-6 [cost]."""


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

    def of(self, acceleration: Array, velocity: Array, place: Array) -> None:
        """What is reported beside velocity and place, body axes of the epochs.

        Args:
            acceleration: (n, 3, m) at the nodes, body axes, m/s^2 per unit.
            velocity: (K, 3, m) written to.
            place: (K, 3, m) written to.
        """
        loops = compiled_loops()
        n, _, m = acceleration.shape
        K = len(self.at)
        if loops is not None:
            turns, first = (self.R, plain(self.R_epoch)), self.at[:, 0].copy()
            of = self.velocity, self.place, plain(acceleration)
            loops.spread(*turns, first, *of, velocity, place)
            return
        there = np.clip(self.at, 0, n - 1)
        weights = np.where(there == self.at, np.stack((self.velocity, self.place)), 0.0)
        turned = (self.R @ acceleration).reshape(n, 3 * m)
        both = weights.swapaxes(0, 1) @ turned[there]
        back = np.swapaxes(self.R_epoch, -1, -2)[:, None] @ both.reshape(K, 2, 3, m)
        velocity[:], place[:] = back[:, 0], back[:, 1]


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
    gains = _gains(window, apart, h)
    ends = np.concatenate([since - 0.5 * step, since[:, -1:] + 0.5 * step], axis=1)
    ahead = np.maximum(-ends, 0.0)
    # What of the integral is beyond either end of a step.
    beyond = sum(
        (share * (mean_beyond(ends) - ahead) for share, mean_beyond in gains), np.zeros_like(ends)
    )
    out: Array = beyond[:, :-1] - beyond[:, 1:]
    return out


def place_weights(since: Array, step: float, window: float) -> Array:
    """(K, n) s^2: those of ``(X(window / 2) + X(-window / 2) - 2 X) / 6``, as of the force's."""
    out: Array = np.maximum(0.5 * window - np.abs(since), 0.0) * (step / 6.0)
    return out


MeanBeyond = Callable[[Array], Array]
"""``E max(tau - x, 0)`` of a response."""


def _gains(window: float, apart: float, h: Array) -> list[tuple[float, MeanBeyond]]:
    """Shares that add up to one (leaning to nothing), and what each shape has beyond a place."""
    half, lag, less = 0.5 * window, window / SPREAD, weight_of_two(window, apart)

    def even(x: Array) -> Array:
        within = np.clip(half - x, 0.0, window)
        out: Array = np.where(x < -half, -x, within**2 / (2.0 * window))
        return out

    def two(older: float) -> MeanBeyond:
        between = between_two(window, older)

        def beyond(x: Array) -> Array:
            newest = np.maximum(older * between - x, 0.0)
            oldest = np.maximum((older - 1.0) * between - x, 0.0)
            out: Array = (1.0 - older) * newest + older * oldest
            return out

        return beyond

    def lagged(x: Array) -> Array:
        before = np.maximum(lag - x, 0.0)
        out: Array = before - lag * (1.0 - np.exp(-before / lag))
        return out

    if less <= 0.0:
        return [(1.0, even)]
    newer, older, leaning, late = h.tolist()
    shares = [
        (1.0 - newer - older - late, even),
        (newer, two(less)),
        (older, two(1.0 - less)),
        (0.5 * leaning, two(0.25)),
        (-0.5 * leaning, two(0.75)),
        (late, lagged),
    ]
    return [(share, beyond) for share, beyond in shares if share]
