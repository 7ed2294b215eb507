"""An airspeed that telemetry tells late is no gust."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.effects.airspeed_lag import AirspeedLag, gained
from onboard.core.vehicle.effects.airspeed_scale import COLUMN, AirspeedScale
from tests.core.vehicle.flights import STEP, G, flight_with, plane_flight
from tests.core.vehicle.planes import matched, names


def speeding(bank=0.0):
    """A plane whose speed swings, straight on, with the force that this takes."""
    t = 50.0 + STEP * np.arange(600)
    speed, gain = 24.0 + 3.0 * np.sin(0.5 * t), 1.5 * np.cos(0.5 * t)
    c, s = np.cos(bank), np.sin(bank)
    R = np.tile(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), (len(t), 1, 1))
    v_n = np.stack([speed, 0.0 * t, 0.0 * t], axis=1)
    f_b = np.einsum("nji,nj->ni", R, np.stack([gain, 0.0 * t, np.full(len(t), -G)], axis=1))
    return t, gain, flight_with(t, R, v_n, np.full(len(t), 600.0), f_b)


@pytest.mark.parametrize("bank", [0.0, 0.8])
def test_what_an_accelerometer_feels_along_the_flow_is_the_speed_that_is_gained(bank):
    _, gain, flight = speeding(bank)
    assert gained(Air(flight, columns=4)) == pytest.approx(gain, abs=1e-9)


def test_a_late_reading_is_that_of_before():
    t, _, flight = speeding()
    air, late = Air(flight, columns=4), 0.2
    AirspeedScale(flight.rho).act(air, [1.0])
    AirspeedLag().act(air, [late])
    before = 24.0 + 3.0 * np.sin(0.5 * (t - late))
    told = before * np.sqrt(flight.rho / 1.225)
    # What a straight line leaves of 0.2 s: a half of the second derivative.
    assert air.force_b[:, COLUMN] == pytest.approx(told, abs=0.5 * late**2 * 0.75 * 1.01)


@pytest.mark.slow
def test_a_reading_that_is_late_is_no_turbulence_and_has_no_other_scale():
    """By what such a force would gain: in these flights it is not that of the path."""
    flight = plane_flight(seed=5, reading=1.0)
    lagging = 0.25 * gained(Air(flight, columns=4))
    match = matched(replace(flight, airspeed=flight.airspeed - lagging))
    assert names(match) == set()
    assert "airspeed sensor" not in match.note
    lag = match.numbers["airspeed_lag"]
    assert abs(lag.real - 0.25) < 4.0 * lag.sigma
    assert lag.sigma < 0.05
