"""What proves an effect is the error along the axes that show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import copter_flight, plane_flight, smooth
from tests.core.vehicle.planes import matched

pytestmark = pytest.mark.slow


def test_what_a_thrust_leaves_is_no_error_of_the_drag():
    """Along the rotors this flight is shaken ten times as much as across."""
    flight = copter_flight(c_m=0.5, seed=4, seconds=150.0)
    f_b = flight.f_b.copy()
    f_b[:, 2] += smooth(np.random.default_rng(8), len(flight), 0.4, 0.3)
    match = match_copter(
        replace(flight, f_b=f_b), Signals(kind="copter"), CopterAirframe(), np.full(3, 0.003)
    )
    (drag,) = (d for d in match.effects if d.name == "rotor_drag")
    assert match.mismatch["z"].after > 0.3
    lateral = np.hypot(match.mismatch["x"].after, match.mismatch["y"].after) / np.sqrt(2.0)
    assert drag.held_out_after == pytest.approx(lateral, rel=0.1)
    assert drag.held_out_before > 5.0 * drag.held_out_after


def test_an_airspeed_is_proven_by_its_own_error():
    match = matched(plane_flight(seed=5, reading=0.86))
    (scale,) = match.effects
    assert scale.name == "airspeed_scale"
    # The sensor's noise is 0.2 m/s, and a tenth of 24 m/s is missing where nobody knows.
    assert scale.held_out_after == pytest.approx(0.2, rel=0.1)
    assert scale.held_out_before > 1.5
