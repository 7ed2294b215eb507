"""Effects of the receiver: where its antenna is, how its clock runs."""

from __future__ import annotations

from copy import copy

import numpy as np

from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.quadrature import Around, lever_velocity
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics.effect import AXES, EffectColumns, Origin


class LeverArm(EffectColumns):
    """Antenna away from where it was told to be: its velocity has a part of the rotation."""

    name = effect = "gps_lever_arm"
    instead_of = "antenna_place"
    source = "rigid body: v_antenna = v + R (w x r)"
    cure = "measure the antenna's place and set GPS1_POS_*"
    apart = "pitch, roll and yaw quickly while GPS is good"
    keys = tuple(AXES)
    plausible = (5.0, 5.0, 5.0)
    unknowns = tuple(Unknown(f"lever_{a}", "m", 0.0, 2.0) for a in AXES)

    def __init__(self, origin: Origin) -> None:
        """Take the place that was told."""
        self._told = origin.antenna
        self._mean = False

    def averaged(self) -> LeverArm:
        """The same, seen through the receiver's average: for a span that is known for sure.

        About a span that is not, the average takes itself for more span and runs away.
        """
        made = copy(self)
        made._mean = True  # noqa: SLF001 - its own copy
        return made

    def velocity(self, around: Around) -> Direct:
        """``R (w x e_i)``."""
        if self._mean:
            return Direct(body=around.swing)
        return Direct(body=lever_velocity(around.now.w_b))

    def position(self, around: Around) -> Direct:
        """``R e_i``."""
        return Direct(body=np.broadcast_to(np.eye(3), (len(around.now.t), 3, 3)))

    def parameters(self, values: dict[str, float]) -> dict[str, float]:  # type: ignore[override] # narrower on purpose
        """Where the antenna is: as told, and what was found on top of it."""
        return {
            f"GPS1_POS_{a.upper()}": told + values[a]
            for a, told in zip(AXES, self._told, strict=True)
        }


class ClockSkew(EffectColumns):
    """Receiver stamps that drift against the IMU's clock."""

    name = effect = "clock_skew"
    source = "delay that grows: rate (t - t0)"
    cure = "look at the time stamps: driver, transport, or a log put together from two clocks"
    apart = "fly longer"
    keys = ("rate",)
    plausible = (0.01,)
    unknowns = (Unknown("clock_rate", "1", 0.0, 3e-3),)

    def __init__(self, origin: Origin) -> None:
        """Take the time from which it counts."""
        self._t0 = origin.t0

    def velocity(self, around: Around) -> Direct:
        """``-a (t - t0)``."""
        age = around.now.t - self._t0
        body = -around.now.f_b[..., None] * age[:, None, None]
        ned = np.zeros_like(body)
        ned[:, 2, 0] = -STANDARD_GRAVITY * age
        return Direct(body=body, ned=ned)

    def position(self, around: Around) -> Direct:
        """``-v (t - t0)``."""
        return Direct(along_velocity=-(around.now.t - self._t0)[:, None])
