from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.copter_match import match_copter
from onboard.core.vehicle.matching import likelier
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_match import match_plane
from onboard.core.vehicle.signals import Signals
from tests.core.vehicle.flights import copter_flight, plane_flight

SIGMA = np.array([0.003, 0.003, 0.01])


def copter(**changes):
    flight = copter_flight(seed=3, seconds=100.0, wind=(3.0, 1.0), noise=0.1, **changes)
    return match_copter(flight, Signals(kind="copter"), CopterAirframe(), SIGMA)


def plane(**changes):
    flight = plane_flight(seed=3, seconds=100.0, wind=(3.0, 1.0), noise=0.2, **changes)
    found = match_plane(flight, PlaneAirframe(), SIGMA)
    assert found is not None
    return found


def test_a_drag_that_is_there_is_fitted_as_if_it_had_no_bound():
    flight = copter_flight(seed=3, seconds=30.0)
    model = copter_model(flight, CopterAirframe(), SIGMA)
    free = likelier(replace(model, bounded=False))
    np.testing.assert_array_equal(likelier(model).theta, free.theta)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("found", "name", "keys"),
    [
        (lambda: copter(area=0.0), "body_drag", ("body_drag.x", "body_drag.y")),
        (lambda: plane(c_drag_p=0.0), "drag", ("drag.c_drag_p",)),
    ],
)
def test_drag_that_chance_would_make_negative_is_none(found, name, keys):
    match = found()
    assert name in {d.name for d in match.effects}
    for key in keys:
        number = match.numbers[key]
        assert 0.0 <= number.real < 3.0 * number.sigma
    assert "less than none" not in match.note


@pytest.mark.slow
@pytest.mark.parametrize(
    ("found", "name", "other", "truth"),
    [
        (lambda: copter(area=-0.02), "body_drag", "rotor_drag.mcoef", 0.24833),
        (lambda: plane(c_drag_p=-0.06), "drag", "lift.c_lift_a", 6.9),
    ],
)
def test_what_pushes_is_something_else_and_bends_nothing(found, name, other, truth):
    match = found()
    assert not match.explained
    assert name not in {d.name for d in match.effects}
    assert f"{name} would have to be less than none" in match.note
    assert match.numbers[other].real == pytest.approx(truth, abs=4.0 * match.numbers[other].sigma)
    assert match.frame["mdrag_coef" if name == "body_drag" else "c_drag_p"] > 0.0
