"""The recorded attitude less its errors: late, turned, or both."""

import numpy as np
import pytest

from onboard.core.estimate.calibration_model import calibration_model, moved
from onboard.core.inputs.segments import Segment
from onboard.core.maths.frames import rotation_from_euler, rotation_from_vector
from onboard.core.model.linearisation import MOVING, SHAPES, Linearisation
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.gps_lever_arm import GpsLeverArm

T = np.linspace(0.0, 4.0, 201)


def attitude(t):
    return rotation_from_euler(0.4 * np.sin(1.1 * t), 0.3 * np.cos(0.7 * t), 0.8 * t)


def recorded(delay, heading, tilt):
    R = rotation_from_euler(0.0, 0.0, heading) @ attitude(T - delay)
    R = R @ rotation_from_vector((*tilt, 0.0))
    still = np.zeros((len(T), 3))
    return Segment(T, still, still, T, R, np.eye(3))


@pytest.mark.parametrize(
    ("delay", "heading", "tilt"),
    [
        (0.08, 0.0, (0.0, 0.0)),
        (0.0, -0.3, (0.0, 0.0)),
        (0.0, 0.0, (-0.11, 0.08)),
        (-0.05, 0.25, (0.2, 0.1)),
    ],
)
def test_delay_heading_and_tilt_are_taken_out_exactly(delay, heading, tilt):
    point = Linearisation(attitude_delay=delay, heading=heading, tilt=tilt)
    at = np.linspace(0.5, 3.5, 40)
    R, near = point.attitude(recorded(delay, heading, tilt), at)
    assert near.all()
    # Interpolated between samples 20 ms apart, to well below a tenth of a milliradian.
    assert np.max(np.abs(R - attitude(at))) < 1e-4


def test_a_nuisance_gives_way_to_the_effect_with_its_columns():
    arm = GpsLeverArm(Origin(t0=0.0))
    without, with_it = (calibration_model(Linearisation(), more=more) for more in ((), (arm,)))
    assert [u.name for u in without.unknowns if u.name.startswith("antenna")] == [
        "antenna_x",
        "antenna_y",
        "antenna_z",
    ]
    assert not {"antenna_x", "antenna_y", "antenna_z"} & set(with_it.index)
    assert with_it.size == without.size


def test_the_linearisation_follows_its_unknowns():
    model = calibration_model(Linearisation())
    theta = model.prior.copy()
    values = (0.03, 0.04, 0.05, -0.2, 0.07, -0.05, 0.2, 0.1, -0.3, 0.4)
    asked = dict(zip(MOVING, values, strict=True))
    for name, value in asked.items():
        theta[model.index[name]] = value
    arm = (0.04, -0.03, 0.02)
    theta[model.slices["antenna_place"]] = arm
    point = Linearisation(delay=0.1, window=0.2, attitude_delay=0.01, heading=0.3)
    after = moved(point, model, theta)
    assert after.antenna == arm
    assert np.subtract(after.moving, point.moving) == pytest.approx(list(asked.values()))
    assert after.shapes == pytest.approx((0.2, 0.1, -0.3, 0.4))
    assert not after.near(point, (0.02, 1.0, 1.0, 1.0))
    assert after.near(point, (0.04, 0.05, 0.06, 0.3))


def test_no_shape_of_a_response_is_taken_for_more_than_the_whole_or_less_than_nothing():
    model = calibration_model(Linearisation())
    theta = model.prior.copy()
    for name, value in zip(SHAPES, (7.7, -0.3, -2.1, 1.4), strict=True):
        theta[model.index[name]] = value
    after = moved(Linearisation(window=0.3, shapes=(0.5, 0.0, 0.0, 0.2)), model, theta)
    assert after.shapes == (1.0, 0.0, -1.0, 1.0)


def test_shapes_alone_ask_for_no_other_linearisation():
    # What they make of a velocity is linear where latency and span stay.
    one, other = Linearisation(window=0.3), Linearisation(window=0.3, shapes=(1.0, 0.5, -0.4, 0.3))
    assert one.near(other, (1e-9, 1e-9, 1e-9, 1e-9))
    assert one.stands_for(other)
