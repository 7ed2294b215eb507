"""Air that rises or sinks all flight long: over a slope, in a thermal.

It has no name, and is asked for as what repeats is (:mod:`onboard.core.vehicle.structure`).
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown
from onboard.core.vehicle.effects.wind import FLOOR_M_S

PLAUSIBLE_M_S = 1.0
"""Standard deviation of a mean over a few minutes, m/s: a thermal or a slope has one to three
[physics]."""
RISING = "rising"


class RisingAir(ByStep):
    """A constant wind upwards.

    A copter that leans has it along its sides as well as through its rotors; one that hovers
    cannot tell it from another thrust.  Left out, air that sank by 2.5 m/s was a propeller with
    another curve (0.722 +-0.017 for 0.65), gusts, and a wind that was 3.4 sigma off.
    """

    def __init__(self, *, name: str = "") -> None:
        """The nominal air neither rises nor sinks; by the name it is asked about."""
        self.name = name
        super().__init__([Unknown(RISING, 0.0, PLAUSIBLE_M_S, FLOOR_M_S, "m/s")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Move the air."""
        air.wind_n[:, 2] -= values[0]
