"""Whether the vehicle flies: standing teaches nothing, so it must not be counted as flight.

On the ground the recorded attitude is levelled by the very accelerometer that is calibrated, and
nothing is excited: such samples would add no information, but they would push the flight out of the
buffer, age its sums and be called "trusted flight".

The autopilot's own word decides where there is one: disarmed, or landed, is on the ground; armed
and not landed is in the air.  Where it says nothing (recordings without states, planes that do not
tell whether they have landed) the motion decides.
"""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.samples import VehicleState
from onboard.core.maths.arrays import Array

STILL_SPEED_M_S = 0.5
"""A receiver at rest shows less: five times the 0.1 m/s of a data sheet's Doppler speed."""
STILL_RATE_RAD_S = 0.02
"""Standard deviation of the rates at rest stays below: gyroscope noise (0.01 deg/s/sqrt(Hz) over
a bandwidth of 50 Hz is 0.001 rad/s) and a vehicle that rocks in the wind.  Stabilised flight stays
above: 0.03 to 0.1 rad/s in real hovers.  A hover that is called standing costs nothing, for it
shows only the sum of z scale and offset."""


class Ground:
    """The autopilot's last word on whether it is armed and has landed.

    Everybody who follows a vehicle keeps one of these: the estimator, the flight that judges a
    push, and the service (which also remembers how old the word is).
    """

    __slots__ = ("armed", "landed")

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The clock began anew, or another recording begins."""
        self.armed: bool | None = None
        self.landed: bool | None = None

    def feed(self, state: VehicleState) -> None:
        """Take a report; what it does not say stays as it was."""
        self.armed = self.armed if state.armed is None else state.armed
        self.landed = self.landed if state.landed is None else state.landed

    def after(self, state: VehicleState) -> Ground:
        """What it will be with this report."""
        following = Ground()
        following.armed, following.landed = self.armed, self.landed
        following.feed(state)
        return following

    @property
    def grounded(self) -> bool | None:
        """True on the ground, False in the air, None where the motion has to decide."""
        return grounded(armed=self.armed, landed=self.landed)


def grounded(*, armed: bool | None, landed: bool | None) -> bool | None:
    """True on the ground, False in the air, None where the autopilot's word does not say.

    Args:
        armed: by the autopilot, None if it has not said.
        landed: likewise.
    """
    if armed is False or landed:
        return True
    return None if landed is None else False


def still(v_n: Array, w_b: Array) -> bool:
    """Whether nothing moved during some seconds.

    Args:
        v_n: (n, 3) GPS velocity, m/s; NaN where a component was not measured.
        w_b: (m, 3) rates, rad/s.
    """
    if len(v_n) == 0 or len(w_b) == 0:
        return False
    speed = np.linalg.norm(np.nan_to_num(v_n), axis=1)
    # One fix in twenty may be off: the percentile, not the largest.
    slow = float(np.percentile(speed, 95)) < STILL_SPEED_M_S
    return slow and float(np.linalg.norm(np.std(w_b, axis=0))) < STILL_RATE_RAD_S
