"""What a receiver that averages sees around GPS epochs.

All of it are differences of what a segment's force gains and of how its attitude turns, so both are
followed once through the segment, in the body axes of its first node, and asked at each epoch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.inputs.limits import AROUND_S
from onboard.core.inputs.reach import apart_of, reach_of
from onboard.core.maths.arrays import Array
from onboard.core.maths.frames import skew
from onboard.core.model.linearisation import SHAPES
from onboard.core.model.quadrature import NODES_PER_SAMPLE, NodeMaker, Signals
from onboard.core.model.response import Response
from onboard.core.model.smoothing import Gained, averaged
from onboard.core.model.spread import (
    Spread,
    nodes_within,
    place_weights,
    reaches,
    velocity_weights,
)

FEWEST_PAIRS = 20
"""Of nodes in :data:`AROUND_S`, however slow the samples: 31 ms each, within which a manoeuvre of
2 Hz bends by 2 % [cost]."""


@dataclass(frozen=True, slots=True)
class Past:
    """The antenna's velocity before K epochs, as far as :mod:`onboard.core.inputs.reach` looks.

    Attributes:
        gained: velocity, in the axes of the segment's first node.
        epoch: (K,) s.
        R: (K, 3, 3) body axes of the epoch to those of the first node.
    """

    gained: Gained
    epoch: Array
    R: Array

    def changes(self, before: Array, weights: Array) -> Array:
        """(K, 3, u) sums of by how much it was larger before, body axes of the epochs, m/s.

        Args:
            before: (n,) s.
            weights: (u, n).
        """
        t, K = (self.epoch - before[:, None]).ravel(), len(self.epoch)
        then = (weights @ self.gained.velocity(t).reshape(len(before), -1)).reshape(-1, K, 3)
        more = then - weights.sum(axis=1)[:, None, None] * self.gained.velocity(self.epoch)
        out: Array = np.swapaxes(self.R, -1, -2) @ np.moveaxis(more, 0, -1)
        return out


@dataclass(frozen=True, slots=True)
class Around:
    """K epochs and what is around them; all but ``R`` in the body axes of the epochs.

    Attributes:
        now: signals at the epochs, S = (K,).
        R: (K, 3, 3) body axes of the epoch to those of the segment's first node.
        averaged: (K, 3) response of a receiver to the velocity that the force makes, less that
            velocity, m/s.
        averaged_place: (K, 3) the same of the antenna's place, m.
        f_mean: (K, 3) mean of the force at the antenna: what a reported velocity changes by, m/s^2.
        slope: (K, 3) derivative of the response, at the antenna, to the square of the span, m/s^3.
        shapes: (K, 3, 4) how else velocities may be averaged that spread alike, m/s
            (:mod:`onboard.core.model.response`).
        shape_places: (K, 3, 4) the same of the antenna's place, m.
        swing: (K, 3, 3) what the receiver sees of a lever arm, per m: mean of ``w x`` over the
            span that it averages, 1/s.
        past: what the antenna's velocity was before.
        spread: what a receiver makes of accelerations; None if it averages over nothing.
    """

    now: Signals
    R: Array
    averaged: Array
    averaged_place: Array
    f_mean: Array
    slope: Array
    shapes: Array
    shape_places: Array
    swing: Array
    past: Past
    spread: Spread | None = None


def around(
    maker: NodeMaker,
    epoch: Array,
    window: float = 0.0,
    antenna: Array | None = None,
    shares: Array | None = None,
) -> Around:
    """What is around epochs.

    Args:
        maker: of the segment's nodes.
        epoch: (K,) s, in order.
        window: over which the receiver averages, s.
        antenna: (3,) lever arm beyond the segment's own, body axes, m; None: none.
        shares: (4,) of other shapes than an even mean; None: none.
    """
    lever = maker.segment.lever_arm_b + (0.0 if antenna is None else antenna)
    reach = reach_of(apart_of(epoch)).around
    followed = _Followed(maker, (float(epoch[0]), float(epoch[-1])), reach, lever)
    force, there = followed.force, followed.there
    now = maker.signals(epoch)
    R, swing = followed.swing(now, window)

    def own(x: Array) -> Array:
        """Of the axes of the first node, (..., K, 3), in those of the epochs."""
        out: Array = (x[..., None, :] @ R)[..., 0, :]
        return out

    shares = np.zeros(len(SHAPES)) if shares is None else shares
    response = Response(there, epoch, window, shares, reach)
    even = force.seen(epoch, [averaged(window, force.step)])[0]
    made = (even + response.shaped, response.place, response.force, response.slope)
    every = own(np.concatenate([np.stack(made), response.shapes, response.places]))
    (seen, place, f_mean, slope), shapes = every[:4], np.moveaxis(every[4:], 0, -1)
    return Around(
        now,
        R,
        seen,
        place,
        f_mean,
        slope,
        shapes[..., : len(SHAPES)],
        shapes[..., len(SHAPES) :],
        swing,
        Past(there, epoch, R),
        followed.spread(epoch, R, window, response.apart, shares) if window > 0.0 else None,
    )


def lever_velocity(w_b: Array) -> Array:
    """(K, 3, 3) columns ``w x e_i``, 1/s: a rigid body's velocity per m of lever arm.

    Args:
        w_b: (K, 3) rate, rad/s.
    """
    return skew(w_b)


class _Followed:
    """Attitude and force of a segment at even nodes, in the axes of the first."""

    def __init__(
        self, maker: NodeMaker, epochs: tuple[float, float], reach: float, lever: Array
    ) -> None:
        """Follow them from before the first of epochs until after the last.

        Args:
            maker: of the nodes.
            epochs: the first and the last, s.
            reach: to either side of an epoch, s.
            lever: (3,) to another place whose force is followed, too, body axes, m.
        """
        self._maker = maker
        # Twice as many as between epochs, for those lie anywhere between these.
        pairs = max(FEWEST_PAIRS, int(np.ceil(NODES_PER_SAMPLE * maker.rate * AROUND_S)))
        self._step, self._reach = AROUND_S / (2 * pairs), reach
        self._start = epochs[0] - reach - self._step
        self._count = int(np.ceil((epochs[1] + reach - self._start) / self._step)) + 2
        nodes = maker.followed(self._start, self._step, self._count, lever)
        self._R, force, there = nodes
        self.force = Gained(self._start, self._step, force)
        """Of the accelerometer."""
        self.there = Gained(self._start, self._step, there)
        """Of the other place."""

    def attitude(self, t: Array) -> Array:
        """(k, 3, 3) at times ``t`` (k,)."""
        return self._maker.turned_on(self._start, self._step, self._R, t)

    def spread(
        self, epoch: Array, R_epoch: Array, window: float, apart: float, shares: Array
    ) -> Spread:
        """What a receiver makes of other accelerations, looked at as coarsely as manoeuvres allow.

        Args:
            epoch: (K,) s.
            R_epoch: (K, 3, 3) attitude at the epochs.
            window: over which it averages, s.
            apart: epochs, s.
            shares: (4,) of other shapes than an even mean.
        """
        each = max(1, int(AROUND_S / FEWEST_PAIRS / self._step))
        step = each * self._step
        t: Array = self._start + step * np.arange(-(-self._count // each), dtype=np.float64)
        at = nodes_within(reaches(window, apart, shares), (epoch - t[0]) / step, step)
        since = t[0] + at * step - epoch[:, None]
        return Spread(
            self._maker.signals(t),
            np.ascontiguousarray(self._R[::each]),
            R_epoch,
            at,
            velocity_weights(since, step, window, apart, shares),
            place_weights(since, step, window, apart, shares),
        )

    def swing(self, now: Signals, window: float) -> tuple[Array, Array]:
        """Attitude at the epochs, and the mean of ``d R / dt`` over the span, in their axes.

        The mean is ``(R(window/2) - R(-window/2)) / window``.

        Args:
            now: signals at the epochs.
            window: s; below two nodes the rate at the epoch does.

        Returns:
            Two arrays (K, 3, 3).
        """
        if window < 2.0 * self._step:
            return self.attitude(now.t), lever_velocity(now.w_b)
        half = min(window / 2.0, self._reach)
        all_ = self.attitude(np.concatenate([now.t, now.t + half, now.t - half]))
        R, after, before = all_.reshape(3, -1, 3, 3)
        out: Array = np.swapaxes(R, -1, -2) @ (after - before) / (2.0 * half)
        return R, out
