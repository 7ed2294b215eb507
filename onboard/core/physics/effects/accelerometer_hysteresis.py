"""An accelerometer whose reading depends on where the load came from."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.physics.effect import Bearing, Effect, Origin, on_axes

LARGEST_TAKEN = 0.8
"""Of the play, m/s^2: a loop as high as its play is wide has no inverse [physics]."""
PLAY = 1.0
"""Half-width of the play, m/s^2: what turns back by less stays on one branch of the loop.  A tenth
of g is more than vibration leaves after the autopilot's low-pass, and less than any manoeuvre
[assumed, not measured: the height that is found belongs to this width]."""


class AccelerometerHysteresis(Effect):
    """Reading that lags behind the load: too small while it rises, too large while it falls.

    Half the height of the loop is the unknown.  The branch is that of a play operator: a follower
    that the load drags along once it has moved by :data:`PLAY` away from it, and which remembers
    its place from segment to segment.
    """

    effect = "accelerometer_hysteresis"
    code = 22
    title = "The accelerometer lags behind the load"
    sentence = "the accelerometer's reading depends on where the load came from"
    meaning = "`x`, `y`, `z`, m/s²: half the height of the loop, too small on the way up"
    bearing = Bearing.WITHIN
    source = "play operator of Prandtl and Ishlinskii; hysteresis error of IEEE Std 1293"
    cure = "ArduPilot has no parameter for it: replace the sensor"
    apart = "load and unload in turn: steep turns both ways, accelerate and brake, climb and dive"
    changes_force = True

    def __init__(self, origin: Origin) -> None:
        """No reference is needed."""
        super().__init__(origin)
        self.take_axes("m/s^2", 1.0)
        self.taken = np.zeros(3)

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:  # noqa: ARG002
        """The follower of the load that is left when ``size`` (3,) is taken off what was read."""
        made = copy(self)
        made.taken = np.clip(size, -LARGEST_TAKEN, LARGEST_TAKEN)
        return made

    def remembers(self, segment: Segment, before: Signal | None) -> Signal:
        """Where the follower is against the load, (n, 3): -1 while it rises and 1 while it falls.

        A raw force will do: a scale is a per cent, and an offset moves load and follower alike.
        """
        f_b = segment.raw_s @ segment.R_bs.T
        place = np.zeros(3)
        if before is not None:
            t, x = before
            place = np.array([np.interp(segment.t[0], t, x[:, j]) for j in range(3)])
        return segment.t, np.column_stack(
            [_branch(f_b[:, j], place[j], self.taken[j]) for j in range(3)]
        )

    def acceleration(self, nodes: Signals) -> Array:
        """``-h_i e_i`` with the branch ``h`` at the nodes."""
        branch = nodes.slow(self.name)
        return on_axes(np.zeros((*nodes.t.shape, 3)) if branch is None else branch)


def _branch(reading: Array, start: float, size: float) -> Array:
    """The follower less the load (n,), in units of the play.

    Args:
        reading: (n,) of one axis, m/s^2: the load, and ``size`` times the branch on top of it.
        start: branch at the first reading.
        size: half the height of the loop as far as it is known, m/s^2.
    """
    out = []
    branch, share = start, size / PLAY
    follower = float(reading[0]) - size * start + start * PLAY
    for read in reading.tolist():
        # At rest the branch is what the load leaves of it: read = load + size branch.
        load = (read - share * follower) / (1.0 - share)
        branch = (follower - load) / PLAY
        if branch < -1.0 or branch > 1.0:
            branch = -1.0 if branch < 0.0 else 1.0
            follower = read - size * branch + branch * PLAY
        out.append(branch)
    return np.array(out)
