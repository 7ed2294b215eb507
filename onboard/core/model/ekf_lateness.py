"""Tilt of an EKF that takes velocities for newer ones than they are."""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard.core.inputs.segments import Segment, Signal
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.around import Around
from onboard.core.model.ekf_loop import LOOP_RAD_S, Recorded, through_loop
from onboard.core.model.regressors import NOTHING, Direct, Family, Unknown

SIGMA_S: Final = 0.1
"""s by which a receiver's delay is another one than its EKF takes it for: they are 0.1 to 0.25 s
[data sheet]."""


class EkfLateness(Family):
    """Delay of the receiver beyond what the autopilot's EKF takes it for: a nuisance.

    Velocities that are older than the EKF thinks differ from its own by ``-late a``, and it tilts
    until they do not: about east by

        e = late w^2 / g  s / (s^2 + 2 d w s + w^2)  a_north,

    and about north by minus the same of ``a_east``.  A copter's tilt goes with its acceleration,
    so that such an attitude, were it held for right, is as good as another scale of x and y: one
    of simulated copters is 0.4 % too small behind a receiver that is 0.2 s late, two sigma.
    """

    name = "ekf_lateness"
    unknowns = (Unknown("ekf_lateness", "s", 0.0, SIGMA_S),)

    def remembers(self, segment: Segment, before: Signal | None) -> Signal | None:
        """The acceleration north and east in the EKF's loop.

        A raw force will do: a scale is a per cent, and what does not change passes no loop.
        """
        recorded = Recorded.of(segment)
        if recorded is None:
            return None
        felt = recorded.gained(segment.t, segment.raw_s @ segment.R_bs.T)
        level = (recorded.R[:, :2] @ felt[..., None])[..., 0]
        return recorded.t, recorded.looped(level, recorded.start(before, 4))

    def attitude(self, around: Around) -> Direct:
        """The tilt that comes of it."""
        z = around.now.slow(self.name)
        if z is None:
            return NOTHING
        north, east = (LOOP_RAD_S**2 / STANDARD_GRAVITY * through_loop(z, 0.0)).T
        return Direct(ned=np.stack([-east, north, 0.0 * north], axis=-1)[..., None])
