"""Wind as the rotors' thrust has it, where that is not what drag says of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

PLAUSIBLE = 5.0
"""m/s; what small rotors induce in hover, ``sqrt(disc loading / (2 rho))`` of 60 N/m^2: by as much
the flow that a law of the climb leaves out may be off in another wind [physics]."""


class RotorWind(ByStep):
    """Flow through the rotors as if so much more wind blew; beside the effects, a flight's own.

    Drag across the thrust is a law of the wind that is told by what it does to the mean force.
    Along the thrust wind shows as flow through rotors that lean, by a law of the climb that leaves
    out what rotors gain in forward flight, and by a battery that nobody measured: where the law is
    wrong it is wrong alike for all of a flight, which flies one trajectory again and again, so that
    its rows seem to tell the wind well.  As far as flights contradict each other in it, their
    thrust is not asked for it.
    """

    name = ""

    def __init__(self, sigma: float) -> None:
        """Take by how much it may be, m/s."""
        towards = ("north", "east")
        super().__init__([Unknown(f"through_{a}", 0.0, sigma, 0.0, "m/s") for a in towards])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """As the wind along the thrust, of which nothing acts across it."""
        down = air.flight.R_bn[:, 2]
        air.through = -sum(
            (down[:, k] * value for k, value in enumerate(values)), np.zeros(len(down))
        )

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "no motor outputs in the recording" if air.commands is None else ""
