"""GPS velocities of a loop that overshoots."""

from __future__ import annotations

import math

import numpy as np

from onboard.core.inputs.limits import AROUND_S
from onboard.core.maths.arrays import Array
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics.effect import Bearing, Effect, Origin
from onboard.core.physics.octaves import WEIGHTS, sigma_of_shapes

NATURAL_HZ = (1.0, 2.0, 4.0)
"""Natural frequencies, an octave apart: what lies between two is much like both.  A quicker loop
is quicker than what vehicles do; a slower one no vehicle could be flown with [physics]."""
DAMPING = 0.7
"""Of tracking loops, as they are designed (E. D. Kaplan and C. J. Hegarty, *Understanding GPS*,
2006, table 5.6: 0.707) [data sheet]."""
LARGEST = 0.05
"""s^2: twice that of a loop of 1 Hz [physics]."""
STEP_S = 0.0125
"""Between the moments of the past that are added up [cost: twenty in the shortest swing]."""
SHAPES = ("slow", "ends")
"""Names of the shapes: more of the slow loop than of the quick one, more of both than between."""


class GpsOvershoot(Effect):
    """Velocity of a tracking loop: where the vehicle stops, it goes on for a moment.

    The loop follows velocity and acceleration without a lag, and is off by what the acceleration
    changes: ``v - s^2 / (s^2 + 2 zeta w s + w^2) v``.  To slow changes that is ``v - v'' / w^2``,
    the opposite of an average, whose variance is never negative.  The size is that ``1 / w^2``;
    three loops share it, and how they do is two shapes.  A receiver that filters what it reports
    with too little damping overshoots alike: the rest of it is latency.
    """

    effect = "gps_overshoot"
    code = 23
    title = "GPS overshoots"
    sentence = "GPS velocity overshoots where the vehicle stops"
    meaning = "`square`, s²: one over the square of the loop's natural frequency in rad/s"
    bearing = Bearing.BESIDE
    source = "second-order tracking loop: (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2)"
    cure = "set the receiver's dynamic model to airborne and raise its rate"
    apart = "accelerate and brake hard and often, quickly and slowly"
    positive = True
    goes_below = ("window_squared",)
    trades = True
    keys = ("square",)
    plausible = (LARGEST,)

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.unknowns = (Unknown(f"{self.name}_square", "s^2", 0.0, LARGEST),)
        self.take_shapes(SHAPES, "s^2", sigma_of_shapes(LARGEST))
        self._before, self._weights = _weights()

    def velocity(self, around: Around) -> Direct:
        """What the loops add to the velocity, by size and shape."""
        return Direct(body=around.past.changes(self._before, self._weights))


def _weights() -> tuple[Array, Array]:
    """Moments of the past (n,), s, and what each weighs in one unit of size and shape, (3, n)."""
    edges = np.linspace(0.0, AROUND_S, round(AROUND_S / STEP_S) + 1)
    before = 0.5 * (edges[1:] + edges[:-1])
    # What is older counts as the parabola through now, half of the past and all of it, so that of
    # a steady acceleration nothing is to be seen, and of a steady jerk what the size says.
    ends = [len(before) // 2, -1]
    powers = np.array([before, before**2])
    loops = []
    for hertz in NATURAL_HZ:
        w = 2.0 * math.pi * hertz
        weight = w * w * np.diff(_stepped(edges, w))
        weight[ends] += np.linalg.solve(powers[:, ends], [0.0, -2.0] - powers @ weight)
        loops.append(weight)
    return before, WEIGHTS @ np.array(loops)


def _stepped(t: Array, w: float) -> Array:
    """Answer of a loop to a step of the velocity at t = 0, s; ``w`` in rad/s."""
    decay, swing = DAMPING * w, w * math.sqrt(1.0 - DAMPING**2)
    going = np.cos(swing * t) - decay / swing * np.sin(swing * t)
    out: Array = 1.0 - np.exp(-decay * t) * going
    return out
