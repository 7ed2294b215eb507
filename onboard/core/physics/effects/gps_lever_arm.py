"""The GPS antenna away from the IMU."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onboard.core.inputs.parameters import receiver_names
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Unknown
from onboard.core.physics.effect import AXES, Bearing, Cure, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import each, listed, places, sure

SIDES = {"x": ("forward", "back"), "y": ("right", "left"), "z": ("down", "up")}
CENTIMETRES = 2
"""Decimals of a place in metres: nobody measures one on a vehicle to the millimetre."""


class GpsLeverArm(Effect):
    """Antenna away from where it was told to be: its velocity has a part of the rotation."""

    effect = "gps_lever_arm"
    code = 3
    title = "The GPS antenna is away from the IMU"
    sentence = "the autopilot is not told that the GPS antenna is {size:.2g} m away from the IMU"
    meaning = "`x`, `y`, `z`, m forward, right, down, on top of `GPS1_POS_*`"
    bearing = Bearing.BESIDE
    instead_of = "antenna_place"
    constant = "the place of the GPS antenna"
    source = "rigid body: v_antenna = v + R (w x r)"
    cure = "measure the antenna's place and set GPSn_POS_* of its receiver"
    apart = "pitch, roll and yaw quickly while GPS is good"
    keys = tuple(AXES)
    plausible = (5.0, 5.0, 5.0)
    unknowns = tuple(Unknown(f"lever_{a}", "m", 0.0, 2.0) for a in AXES)

    def velocity(self, around: Around) -> Direct:
        """``R (w x e_i)``, as the receiver sees it."""
        return Direct(body=around.swing)

    def position(self, around: Around) -> Direct:
        """``R e_i``."""
        return Direct(body=np.broadcast_to(np.eye(3), (len(around.now.t), 3, 3)))

    def cured(self, values: Mapping[str, float]) -> Cure:
        """Where the antenna is: as told, and what was found on top of it."""
        names = receiver_names(self.origin.receiver)
        place = {
            names[a.upper()][0]: told + values[a]
            for a, told in zip(AXES, self.origin.antenna, strict=True)
        }
        return Cure(self.cure, place)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``0.80 m forward and 0.41 m up``."""
        sides = [
            f"{abs(q.value):.{min(places(q.sigma), CENTIMETRES)}f} m {SIDES[k][q.value < 0.0]}"
            for k, q in sure(found.unknowns).items()
            if k in SIDES
        ]
        return listed(sides) if sides else each(found.unknowns)
