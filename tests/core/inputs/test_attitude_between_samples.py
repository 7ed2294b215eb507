"""The recorded attitude between its samples: the gyroscope says how it turned."""

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.maths.frames import (
    interpolate_rotation,
    rotation_from_euler,
    vector_from_rotation,
)


def angles(t):
    """A vehicle that rolls to both sides at 0.4 Hz, nods and turns: rad."""
    return 0.6 * np.sin(2.5 * t), 0.2 * np.sin(1.7 * t + 0.4), 0.5 * t


def attitude(t):
    return rotation_from_euler(*angles(np.asarray(t)))


def rates(t):
    """Body rates by finite differences of the attitude itself, rad/s."""
    h = 1e-4
    return vector_from_rotation(np.swapaxes(attitude(t - h), -1, -2) @ attitude(t + h)) / (2 * h)


def segment(period, bias=0.0, delay=0.0):
    """Samples at 50 Hz; attitude every ``period`` s, on a clock ``delay`` ahead."""
    t = np.arange(0.0, 20.0, 0.02)
    t_attitude = np.arange(0.0, 20.0, period)
    raw = np.zeros((len(t), 3))
    recorded = attitude(t_attitude)
    return Segment(t, rates(t) + bias, raw, t_attitude + delay, recorded, np.eye(3))


def off(R, t):
    return np.abs(vector_from_rotation(np.swapaxes(R, -1, -2) @ attitude(t))).max()


AT = np.linspace(1.0, 18.0, 1234)


@pytest.mark.parametrize("period", [0.04, 0.1, 0.25, 0.5])
def test_it_is_that_of_the_vehicle_however_seldom_it_is_recorded(period):
    made = segment(period)
    R, near = made.attitude_at(AT)
    assert near.all()
    assert off(R, AT) < 1e-3
    # A constant rate between the samples would not do.
    straight = interpolate_rotation(AT, made.t_attitude, made.R_attitude)
    assert off(straight, AT) > 5.0 * off(R, AT)


def test_at_the_samples_it_is_what_was_recorded():
    made = segment(0.25)
    R, _ = made.attitude_at(made.t_attitude[4:70])
    np.testing.assert_allclose(R, made.R_attitude[4:70], atol=1e-12)


def test_a_bias_of_the_gyroscope_is_taken_out_by_the_samples():
    """0.05 rad/s over half of 0.25 s would be 6 mrad."""
    R, _ = segment(0.25, bias=0.05).attitude_at(AT)
    assert off(R, AT) < 1.5e-3


def test_the_clock_of_the_attitude_may_be_ahead():
    R, _ = segment(0.25, delay=0.07).attitude_at(AT + 0.07, delay=0.07)
    assert off(R, AT) < 1.1e-3


def test_where_it_pauses_for_too_long_nothing_vouches_for_it():
    made = segment(0.8)
    _, near = made.attitude_at(AT)
    # Only what is next to a sample counts.
    share = near.mean()
    assert 0.02 < share < 0.1
