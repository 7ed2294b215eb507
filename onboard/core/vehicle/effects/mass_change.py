"""What changes in flight: a payload that is dropped or taken up, a rotor that gives way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import STEP_S, WINDOW_STEPS

PLAUSIBLE = 0.3
"""Of the logarithm: what a vehicle can carry on top of itself, or lose of its thrust, and still fly
[physics]."""
FLOOR = 0.05
"""Of the logarithm: 5 % of the thrust, as of its scale [use]."""
MOMENT_SIGMA_S = STEP_S * WINDOW_STEPS / math.sqrt(12.0)
"""s; it is known to a window of the fit [probability]."""


@dataclass(frozen=True, slots=True)
class Change:
    """Over which seconds of a flight's clock something goes from one level to another, for good.

    The airframe's numbers are those of the vehicle before it, or of that after it (``since``).
    """

    begin: float
    end: float
    since: bool = False

    def share(self, flight: Flight) -> Array:
        """(n,) of the change that each step is from the airframe, in the recording it is in."""
        if self.end > self.begin:
            gone = np.clip((flight.t - self.begin) / (self.end - self.begin), 0.0, 1.0)
        else:
            gone = (flight.t >= self.begin).astype(float)
        out: Array = np.where(flight.part == self.part(flight), gone - float(self.since), 0.0)
        return out

    def part(self, flight: Flight) -> int:
        """Number of the recording it is in, of several."""
        at = min(int(np.searchsorted(flight.t, self.begin)), len(flight) - 1)
        return int(flight.part[at])


class _Changed(Effect):
    """A logarithm that has one value before the change and another after it."""

    def __init__(self, change: Change, flight: Flight) -> None:
        """Nominally nothing changes."""
        super().__init__([Unknown("log_ratio", 0.0, PLAUSIBLE, FLOOR, "1")])
        self.change = change
        first = float(flight.t[flight.part == change.part(flight)][0])
        self._moment = 0.5 * (change.begin + change.end) - first
        side = "after" if change.since else "before"
        self.note = f"all other numbers are those of the vehicle {side} the change"

    def _factor(self, air: Air, value: float) -> Array:
        return np.exp(value * self.change.share(air.flight))

    def missing(self, air: Air) -> str:
        """It takes outputs."""
        return "" if air.commands is not None else "no motor outputs in the recording"

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """After over before, and when."""
        ratio = math.exp(values[0])
        return [
            Shown("ratio", 1.0, ratio, ratio * sigmas[0], "1"),
            Shown("moment", math.nan, self._moment, MOMENT_SIGMA_S, "s"),
        ]


class MassChange(_Changed):
    """The mass is another from a moment on: all forces of the air by mass change at once.

    It acts before the forces.
    """

    name = "mass_change"
    manoeuvre = "fly fast before and after it: drag by mass changes as well, if it is the mass"

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Make the vehicle heavier or lighter."""
        air.mass = self._factor(air, values[0])


class ThrustChange(_Changed):
    """The thrust of the same command is another from a moment on, and the drag is not.

    It acts after the thrust.
    """

    name = "thrust_change"
    manoeuvre = "fly fast before and after it: drag by mass does not change, if it is the thrust"

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Scale the thrust."""
        if air.thrust is not None:
            air.thrust = air.thrust * self._factor(air, values[0])
