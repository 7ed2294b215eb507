"""Where the problem is taken to be linear: timing, and the calibration in force."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array, Vector2, Vector4, vector2, vector3, vector4
from onboard.core.maths.frames import rotation_from_euler, rotation_from_vector
from onboard.core.maths.interpolation import Hermite

SHAPES = ("mostly_newer", "mostly_older", "leaning", "lagging")
"""How a receiver may weigh what is in its span, beside an even mean."""
MOVING = (
    "gps_delay",
    "window_squared",
    "attitude_delay",
    "heading",
    "tilt_roll",
    "tilt_pitch",
    *SHAPES,
)
"""Unknowns that are estimated about the linearisation, which follows them."""

LINEAR = ((1e-3, 2e-3, 5e-3, 0.02, 0.02, 0.02), 0.01, 0.1, 0.015, 1e-5)
"""Moves of the first of :data:`MOVING`, scale (1), beta (m/s^2), antenna (m) and clock (s/s) over
which unknowns are linear well enough to find noise levels, and the point where the sums are to be
made [cost]."""


@dataclass(frozen=True, slots=True)
class Linearisation:
    """The point about which the non-linear unknowns are expanded.

    Attributes:
        scale: (3,) of the accelerometer.
        beta: (3,) ``-scale * offset``, m/s^2.
        delay: GPS latency, s.
        window: averaging span of the receiver, s.
        shapes: (4,) shares of :data:`SHAPES` in how it weighs what is in its span.
        attitude_delay: lateness of the recorded attitude, s.
        heading: how much too large the recorded yaw is, rad.
        tilt: how much too large the recorded roll and pitch are, (2,) rad, fixed in the body.
        antenna: (3,) lever arm beyond the configured one, body axes, m, whose velocity latency and
            averaging act on; the unknown itself is linear and counted from nothing.
        skew: growth of the latency, s/s, from ``skew_from`` (s on the boot clock) on.
        skew_from: see ``skew``.
    """

    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    beta: tuple[float, float, float] = (0.0, 0.0, 0.0)
    delay: float = 0.1
    window: float = 0.0
    attitude_delay: float = 0.0
    heading: float = 0.0
    antenna: tuple[float, float, float] = (0.0, 0.0, 0.0)
    skew: float = 0.0
    skew_from: float = 0.0
    shapes: Vector4 = (0.0, 0.0, 0.0, 0.0)
    tilt: Vector2 = (0.0, 0.0)

    def true_time(self, stamp: Array) -> Array:
        """When what a fix with these stamps says was true, s."""
        out: Array = stamp - self.delay - self.skew * (stamp - self.skew_from)
        return out

    def stamp(self, true_time: Array) -> Array:
        """Inverse of :meth:`true_time`, s."""
        out: Array = (true_time + self.delay - self.skew * self.skew_from) / (1.0 - self.skew)
        return out

    @property
    def moving(self) -> tuple[float, ...]:
        """What has been taken in of the unknowns :data:`MOVING`."""
        timing = self.delay, self.window**2, self.attitude_delay
        return *timing, self.heading, *self.tilt, *self.shapes

    def near(self, other: Linearisation, within: Sequence[float]) -> bool:
        """Whether no unknown has moved by as much as ``within``.

        Shapes may have: where latency and span stay, what they make of a velocity is linear.
        """
        moves = np.abs(np.subtract(self.moving, other.moving))
        return bool(np.all(moves[: len(within)] < np.array(within)))

    def towards(self, other: Linearisation, share: float) -> Linearisation:
        """The point that lies a ``share`` of the way to another one; spans go by their squares."""

        def between(a: float, b: float) -> float:
            return a + share * (b - a)

        def each(a: Sequence[float], b: Sequence[float]) -> Iterator[float]:
            return (between(x, y) for x, y in zip(a, b, strict=True))

        return replace(
            other,
            scale=vector3(each(self.scale, other.scale)),
            beta=vector3(each(self.beta, other.beta)),
            delay=between(self.delay, other.delay),
            window=math.sqrt(between(self.window**2, other.window**2)),
            attitude_delay=between(self.attitude_delay, other.attitude_delay),
            heading=between(self.heading, other.heading),
            antenna=vector3(each(self.antenna, other.antenna)),
            skew=between(self.skew, other.skew),
            shapes=vector4(each(self.shapes, other.shapes)),
            tilt=vector2(each(self.tilt, other.tilt)),
        )

    def stands_for(self, other: Linearisation) -> bool:
        """Whether unknowns about this point say where that one is: :data:`LINEAR`."""
        timing, scale, beta, antenna, clock = LINEAR
        moves = (
            (self.scale, other.scale, scale),
            (self.beta, other.beta, beta),
            (self.antenna, other.antenna, antenna),
            (self.skew, other.skew, clock),
        )
        return self.near(other, timing) and all(
            float(np.abs(np.subtract(a, b)).max()) < most for a, b, most in moves
        )

    def attitude(
        self, segment: Segment, t: Array, curve: Hermite | None = None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Recorded attitude (m, 3, 3) at ``t`` less its errors, and where samples vouch for it."""
        R, near = segment.attitude_at(t + self.attitude_delay, self.attitude_delay, curve)
        return _turned(-self.heading) @ R @ _tilted(self.tilt), near

    @property
    def six(self) -> Array:
        """(6,) scale, beta."""
        return np.array(self.scale + self.beta)


@lru_cache(maxsize=4)
def _turned(heading: float) -> Array:
    """(3, 3) turn about down: all segments about one linearisation have the same."""
    return rotation_from_euler(0.0, 0.0, heading)


@lru_cache(maxsize=4)
def _tilted(tilt: Vector2) -> Array:
    """(3, 3) turn that takes a tilt of the body off an attitude, likewise."""
    return rotation_from_vector((-tilt[0], -tilt[1], 0.0))
