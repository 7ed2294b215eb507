from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_match import match_plane
from tests.core.vehicle.flights import plane_flight

pytestmark = pytest.mark.slow
SIGMA = np.array([0.003, 0.003, 0.01])


def matched(flight):
    match = match_plane(flight, PlaneAirframe(), SIGMA)
    assert match is not None
    return match


def names(match):
    return {d.name for d in match.effects}


def test_the_nominal_plane_is_clean_whichever_way_its_airspeed_is_reckoned():
    assert names(matched(plane_flight())) == set()
    assert names(matched(plane_flight(reading=1.0, seed=2))) == set()
    assert names(matched(plane_flight(reading=0.967, seed=3))) == set()


def test_the_wind_of_a_plane_is_found():
    match = matched(plane_flight(wind=(2.4, 6.6), seed=4))
    assert names(match) == {"wind"}
    assert match.wind is not None
    assert match.wind.north == pytest.approx(2.4, abs=0.15)
    assert match.wind.east == pytest.approx(6.6, abs=0.15)


@pytest.mark.parametrize(
    ("change", "effect", "key", "truth"),
    [
        ({"c_drag_p": 0.2}, "drag", "drag.c_drag_p", 0.2),
        ({"c_lift_0": 0.4}, "lift", "lift.c_lift_0", 0.4),
        ({"c_y_b": -0.5}, "side_force", "side_force.c_y_b", -0.5),
        ({"reading": 0.86}, "airspeed_scale", "airspeed_scale.scale", 0.86),
    ],
)
def test_each_coefficient_that_is_off_is_named_alone_with_its_value(change, effect, key, truth):
    match = matched(plane_flight(seed=5, **change))
    assert names(match) == {effect}
    number = match.numbers[key]
    assert abs(number.real - truth) < 4.0 * number.sigma


def test_a_propeller_that_pulls_less_at_speed_is_no_drag():
    """With the nominal one for all the thrust, the speed's share would be the profile's drag."""
    match = matched(plane_flight(seed=8, lost=0.008))
    assert "drag" not in names(match)
    drag = match.numbers["drag.c_drag_p"]
    assert abs(drag.real - 0.1) < 3.0 * drag.sigma
    slope = match.numbers["propeller_inflow"]
    assert abs(slope.real - 0.008) < 3.0 * slope.sigma
    assert slope.real > 3.0 * slope.sigma


def test_drag_of_sideslip_is_no_other_drag():
    match = matched(plane_flight(seed=9, slip_drag=1.5))
    assert names(match) == set()
    slip = match.numbers["slip_drag"]
    assert abs(slip.real - 1.5) < 3.0 * slip.sigma


def test_a_heading_that_is_as_good_as_compasses_are_leaves_nothing_unexplained():
    good, bad = (matched(plane_flight(seed=10, heading_off=off)) for off in (0.02, 0.1))
    assert names(good) == set()
    assert good.explained
    assert not bad.explained
