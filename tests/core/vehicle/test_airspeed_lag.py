"""An airspeed that telemetry tells late is no gust."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.airspeed_lag import AirspeedLag, gained
from onboard.core.vehicle.effects.airspeed_scale import COLUMN, AirspeedScale
from tests.core.vehicle.flights import STEP, flight_with, plane_flight
from tests.core.vehicle.planes import matched, names


def speeding():
    """A plane whose speed swings, straight on."""
    t = 50.0 + STEP * np.arange(600)
    speed, gain = 24.0 + 3.0 * np.sin(0.5 * t), 1.5 * np.cos(0.5 * t)
    v_n = np.stack([speed, 0.0 * t, 0.0 * t], axis=1)
    R = np.tile(np.eye(3), (len(t), 1, 1))
    return t, gain, flight_with(t, R, v_n, np.full(len(t), 600.0), 0.0 * v_n)


def test_speed_is_gained_from_step_to_step_and_not_over_what_is_left_out():
    t, gain, flight = speeding()
    kept = (np.arange(len(t)) % 100 < 60) | (np.arange(len(t)) == 180)
    found = gained(Air(flight.cut(kept), columns=4))
    assert found == pytest.approx(np.where(t == t[180], 0.0, gain)[kept], abs=0.06)


def test_a_late_reading_is_that_of_before():
    t, _, flight = speeding()
    air, late = Air(flight, columns=4), 0.2
    AirspeedScale(flight.rho).act(air, [1.0])
    AirspeedLag().act(air, [late])
    before = 24.0 + 3.0 * np.sin(0.5 * (t - late))
    told = before * np.sqrt(flight.rho / 1.225)
    # What a straight line leaves of 0.2 s, a half of the second derivative; and more at the ends.
    assert air.force_b[:, COLUMN] == pytest.approx(told, abs=0.03)


@pytest.mark.slow
def test_a_reading_that_is_late_is_no_turbulence_and_has_no_other_scale():
    flight = plane_flight(seed=5, reading=1.0)
    lagging = 0.25 * gained(Air(flight, columns=4))
    match = matched(replace(flight, airspeed=flight.airspeed - lagging))
    assert names(match) == set()
    assert "airspeed sensor" not in match.note
    lag = match.numbers["airspeed_lag"]
    assert abs(lag.real - 0.25) < 4.0 * lag.sigma
    assert lag.sigma < 0.05
