"""A battery that gives way: thrust falls with the square of the voltage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown

FLOOR = 0.2
"""Of the share of the voltage's square [use]."""
LEAST_FALL = 0.002
"""Relative scatter of the voltage without which it shows nothing: what a converter of 12 bits and
its supply are good for.  Of what falls by more the fit says how well it is known [data sheet]."""

HELD = "the voltage hardly changed"
"""Why nothing is seen of it where the battery is as the nominal one."""


class VoltageSag(Effect):
    """Thrust goes with ``(V / V_full)^(2 share)``: 1 of a motor, 0 of a battery that holds.

    More is not to be had: a motor turns no faster than its voltage lets it, and less where its
    load, which grows with the speed, takes from it.  What falls more has another cause beside.
    """

    name = "voltage_sag"
    commanded = True
    manoeuvre = "fly from a full battery to the warning, with full throttle now and then"

    def __init__(self, full_voltage: float) -> None:
        """Nominally a constant voltage (battCapacityAh 0)."""
        share = Unknown("share", 0.0, 1.0, FLOOR, "1", doubt=0.005, most=1.0)
        super().__init__([share])
        self.full_voltage = full_voltage

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Scale the power."""
        if air.power is not None and air.volts is not None:
            ratio = np.maximum(air.volts / self.full_voltage, 0.05)
            air.power = air.power * ratio ** (2.0 * values[0])

    def missing(self, air: Air) -> str:
        """It takes outputs, and a voltage that changes."""
        if air.commands is None:
            return "no motor outputs in the recording"
        if air.volts is None:
            return "no battery voltage in the recording"
        if float(np.std(np.log(np.maximum(air.volts, 0.1)))) < LEAST_FALL:
            return HELD
        return ""

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """The exponent of the voltage."""
        return [Shown("exponent", 0.0, 2.0 * values[0], 2.0 * sigmas[0], "1")]
