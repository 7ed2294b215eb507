"""An airspeed that stands in the recording later than it was."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.air import Air, speed_of
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY
from onboard.core.vehicle.effects.airspeed_scale import COLUMN
from onboard.core.vehicle.effects.effect import ByStep, Unknown

PLAUSIBLE_S = 0.2
"""Telemetry tells an airspeed without a time, filtered and some tenths of a second late: 0.2 s in
VFR_HUD of ArduPilot's simulator, nothing in its logs [data sheet]."""


class AirspeedLag(ByStep):
    """The reading less its slope times the lag; beside the effects, after the scale.

    Left to gusts it would be some, wherever a plane gains and loses speed.  The slope is that of
    the speed through steady air: gusts are not in it, for which nobody knows.
    """

    def __init__(self) -> None:
        """Nominally none."""
        super().__init__([Unknown("airspeed_lag", 0.0, PLAUSIBLE_S, 0.0, "s")])

    def act_by(self, air: Air, values: Sequence[Array]) -> None:
        """Take the reading to where it was."""
        late = values[0] * gained(air) * np.sqrt(air.rho / SEA_LEVEL_DENSITY)
        air.force_b[:, COLUMN] -= late


def gained(air: Air) -> Array:
    """(n,) speed through steady air that is gained in a second, m/s^2: of steps that are in a row.

    From the step before to the one behind; of what stands alone nobody knows.
    """
    flight, speed = air.flight, air.by_flow(speed_of)
    row = np.abs(np.diff(flight.t) - flight.step_s) < 0.5 * flight.step_s
    row &= (np.diff(flight.piece) == 0) & (np.diff(flight.part) == 0)
    slope = np.where(row, np.diff(speed), 0.0) / flight.step_s
    out: Array = np.zeros(len(speed))
    sides = np.zeros(len(speed))
    for side in (slice(1, None), slice(None, -1)):
        out[side] += slope
        sides[side] += row
    out /= np.maximum(sides, 1.0)
    return out
