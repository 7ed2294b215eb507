"""An EKF whose velocities are older than it thinks, against the column for its attitude."""

import math

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.maths.earth import STANDARD_GRAVITY as G
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.model.around import around
from onboard.core.model.ekf_lateness import EkfLateness
from onboard.core.model.ekf_loop import DAMPING, LOOP_RAD_S
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model

H = 2e-3
T = np.arange(0.0, 40.0, H)
LATE_S = 0.05


def acceleration(t):
    """(n, 2) m/s^2, north and east: stops and goes, and turns."""
    return np.stack([2.0 * np.sin(0.9 * t), 1.5 * np.cos(0.4 * t) + np.sin(2.0 * t)], axis=-1)


@pytest.fixture(scope="module")
def tilt():
    """(n, 2) rad about north and east: two loops, each step by step, as an EKF has them."""
    velocity = np.cumsum(acceleration(T), axis=0) * H
    told = np.stack([np.interp(T - LATE_S, T, v) for v in velocity.T], axis=-1)
    by_velocity, by_tilt = 2.0 * DAMPING * LOOP_RAD_S, LOOP_RAD_S**2 / G
    e, v = np.zeros((len(T), 2)), np.zeros((len(T), 2))
    for k in range(len(T) - 1):
        innovation = told[k] - v[k]
        # exp(e x) turns the force -g down by e x f: to (-g e_east, +g e_north).
        feels = acceleration(T[k]) + G * np.array([-e[k, 1], e[k, 0]])
        v[k + 1] = v[k] + H * (feels + by_velocity * innovation)
        e[k + 1] = e[k] + H * by_tilt * np.array([innovation[1], -innovation[0]])
    return e


def flown(yaw=0.7):
    """(n, 3, 3) attitudes and (n, 3) forces, body axes, of a copter that turns its nose."""
    a = acceleration(T)
    R = rotation_from_vector(np.stack([0.1 * a[:, 1], -0.1 * a[:, 0], yaw * np.sin(0.2 * T)], -1))
    f_n = np.concatenate([a, np.full((len(T), 1), -G)], axis=1)
    return R, np.einsum("nji,nj->ni", R, f_n)


def segment_of(start, end, hz=10.0):
    """Samples at 50 Hz, attitudes at ``hz``, as a flight's segments are."""
    R, f_b = flown()
    cut = slice(round(start / H), round(end / H), round(0.02 / H))
    few = slice(0, None, round(1.0 / hz / H))
    return Segment(T[cut], np.zeros((len(T[cut]), 3)), f_b[cut], T[few], R[few], np.eye(3))


def column(segment, t, before=None):
    """(k, 3) rad per s of lateness."""
    model = Model([EkfLateness()])
    made = model.remembering(segment, {} if before is None else {EkfLateness.name: before})
    near = around(NodeMaker(made, np.zeros(3), np.repeat([1.0, 0.0], 3)), t)
    return EkfLateness().attitude(near).ned[..., 0]


@pytest.mark.parametrize("hz", [4.0, 10.0, 50.0])
def test_the_column_is_how_far_an_ekf_tilts(tilt, hz):
    """To first order in a lateness that is short beside the manoeuvres."""
    at = np.arange(2.0, 38.0, 0.5)
    got = LATE_S * column(segment_of(0.0, 40.0, hz), at)
    want = np.stack([np.interp(at, T, x) for x in tilt.T], axis=-1)
    assert np.abs(want).max() > 1e-3
    np.testing.assert_allclose(got[:, :2], want, atol=0.08 * np.abs(want).max())
    assert not got[:, 2].any()


def test_it_goes_on_from_segment_to_segment():
    """What was flown before is still there where the next one begins."""
    family, at = EkfLateness(), np.array([22.0, 25.0, 30.0])
    before = family.remembers(segment_of(0.0, 22.0), None)
    whole = column(segment_of(0.0, 40.0), at)
    np.testing.assert_allclose(column(segment_of(20.0, 40.0), at, before), whole, atol=1e-4)
    assert np.abs(column(segment_of(20.0, 40.0), at)[0] - whole[0]).max() > 5e-3


def test_a_segment_without_attitudes_shows_nothing():
    assert EkfLateness().remembers(segment_of(0.0, 0.1, hz=4.0), None) is None
    maker = NodeMaker(segment_of(0.0, 10.0), np.zeros(3), np.repeat([1.0, 0.0], 3))
    assert EkfLateness().attitude(around(maker, np.array([5.0]))).ned is None


def test_at_rest_and_at_a_steady_speed_there_is_none():
    """The force is gravity alone, whatever the heading is."""
    R = rotation_from_vector(np.stack([0.0 * T, 0.0 * T, 0.3 * T], axis=-1))
    f_b = np.tile([0.0, 0.0, -G], (len(T), 1))
    at = np.array([5.0, 20.0])
    got = column(Segment(T, 0.0 * f_b, f_b, T[::50], R[::50], np.eye(3)), at)
    assert np.abs(got).max() < 1e-12
    assert math.isfinite(got.sum())
