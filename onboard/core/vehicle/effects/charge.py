"""How full a battery was, where its voltage was not recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import ByStep, Unknown

FULLER = 0.1
"""Of the logarithm of the thrust by one command, from flight to flight: a lithium cell has 4.2 to
3.5 V, and thrust goes with the square of that [data sheet]."""
EMPTIER = 4e-4
"""1/s; of its change over time: from full to empty in a quarter of an hour [data sheet]."""


class Charge(ByStep):
    """Thrust by one command is ``exp(emptier (t - middle) + fuller)`` of the vehicle's.

    Beside the effects, after the thrust's scale, each flight with its own numbers.  What is left
    out of the thrust is taken for air that comes through the rotors, and that for wind.  Where the
    voltage was recorded, :class:`~onboard.core.vehicle.effects.voltage_sag.VoltageSag` has it.
    """

    def __init__(self, *, alone: bool) -> None:
        """Take whether there is no other flight: what is ``fuller`` is then the thrust's scale."""
        emptier = Unknown("emptier", 0.0, EMPTIER, 0.0, "1/s")
        fuller = Unknown("fuller", 0.0, FULLER, 0.0, "1")
        super().__init__([emptier] if alone else [emptier, fuller])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """More thrust, or less."""
        if air.thrust is None:
            return
        flight = air.flight
        since = flight.since_start
        middle = np.bincount(flight.part, since) / np.bincount(flight.part)
        more = values[0] * (since - middle[flight.part])
        air.thrust = air.thrust * np.exp(sum(values[1:], more))

    def missing(self, air: Air) -> str:
        """It takes outputs, and no voltage."""
        if air.commands is None:
            return "no motor outputs in the recording"
        return "" if air.volts is None else "the voltage was recorded"
