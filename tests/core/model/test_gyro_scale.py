"""An EKF that integrates a gyroscope which is wrong, against the column for its attitude."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.segments import Segment
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.small_turns import turn_by
from onboard.core.model.around import around
from onboard.core.model.ekf_loop import DAMPING, LOOP_RAD_S
from onboard.core.model.gyro_scale import HEADING_S, GyroScale
from onboard.core.model.quadrature import NodeMaker
from onboard.core.model.regressors import Model

H = 1e-3
T = np.arange(0.0, 24.0, H)
SIX = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def rates(t):
    """(n, 3) rad/s: rolls and turns as a copter's."""
    return np.stack([1.2 * np.sin(2.0 * t), 0.8 * np.cos(1.3 * t), 0.5 * np.sin(0.7 * t)], axis=-1)


@pytest.fixture(scope="module")
def attitude():
    R = np.empty((len(T), 3, 3))
    R[0] = np.eye(3)
    for k, w in enumerate(rates(T[:-1] + 0.5 * H)):
        R[k + 1] = R[k] @ turn_by(w * H)
    return R


def followed(R, scale):
    """(n, 3) rad, NED: how far an EKF is off whose gyroscope reads ``scale`` too much.

    Step by step, with its velocity (n, 2) that the tilt makes grow and that fixes take back.
    """
    d, v, w = np.zeros((len(T), 3)), np.zeros(2), rates(T)
    by_velocity, by_tilt = 2.0 * DAMPING * LOOP_RAD_S, LOOP_RAD_S**2 / STANDARD_GRAVITY
    for k in range(len(T) - 1):
        taken_back = [-by_tilt * v[1], by_tilt * v[0], -d[k, 2] / HEADING_S]
        d[k + 1] = d[k] + H * (R[k] @ (scale * w[k]) + taken_back)
        feels = STANDARD_GRAVITY * np.array([-d[k, 1], d[k, 0]])
        v = v + H * (feels - by_velocity * v)
    return d


def segment_of(R, start, end, hz=10.0, *, own=True):
    """Samples at 50 Hz, attitudes at ``hz``, as a flight's segments are."""
    i, j = round(start / H), round(end / H)
    cut, few = slice(i, j, round(0.02 / H)), slice(0, None, round(1.0 / hz / H))
    w = rates(T[cut])
    return Segment(T[cut], w, w, T[few], R[few], np.eye(3), gyro_followed=own)


def seen(segment, t, before=None):
    """(k, 3, 3) what the family has for the recorded attitude at ``t`` (k,)."""
    made = Model([GyroScale()]).remembering(segment, before or {})
    return GyroScale().attitude(around(NodeMaker(made, np.zeros(3), SIX), t)).ned


@pytest.mark.parametrize("hz", [4.0, 10.0, 50.0])
@pytest.mark.parametrize("axis", range(3))
def test_the_column_is_how_far_an_ekf_is_off(attitude, axis, hz):
    """Within a few per cent: of an angle of some milliradians, which is all that an EKF shows."""
    at = np.arange(1.0, 23.0, 0.25)
    got = seen(segment_of(attitude, 0.0, 24.0, hz), at)[..., axis]
    want = np.stack([np.interp(at, T, x) for x in followed(attitude, np.eye(3)[axis]).T], axis=-1)
    assert np.abs(got - want).max() < 0.04 * np.abs(want).max()


def test_it_goes_on_from_segment_to_segment(attitude):
    """What was turned before is still there where the next one begins."""
    family, at = GyroScale(), np.array([12.0, 15.0, 20.0])
    whole = seen(segment_of(attitude, 0.0, 24.0), at)
    before = {family.name: family.remembers(segment_of(attitude, 0.0, 13.0), None)}
    after = segment_of(attitude, 11.0, 24.0)
    np.testing.assert_allclose(seen(after, at, before), whole, atol=1e-6)
    assert np.abs(seen(after, at)[0] - whole[0]).max() > 0.1


def test_it_reaches_the_recorded_attitude_at_the_fixes(attitude):
    segment = segment_of(attitude, 0.0, 24.0)
    model = Model([GyroScale()])
    made = model.remembering(segment, {})
    maker = NodeMaker(made, np.zeros(3), SIX)
    epochs = np.array([5.0, 5.2, 5.4])
    near = around(maker, epochs)
    got = model.regressors(maker.intervals(epochs[:-1], epochs[1:]), near)
    want = seen(segment, epochs)
    assert np.abs(want).max() > 0.1
    np.testing.assert_allclose(got.attitude_ned, want, atol=1e-12)
    assert not got.attitude_body.any()


def test_an_attitude_of_another_gyroscope_does_not_follow(attitude):
    segment = segment_of(attitude, 0.0, 24.0, own=False)
    assert GyroScale().remembers(segment, None) is None
    maker = NodeMaker(segment, np.zeros(3), SIX)
    assert GyroScale().attitude(around(maker, np.array([5.0]))).ned is None


def test_an_hour_without_a_fix_is_no_number_too_large(attitude):
    """Nothing of what was before is left, and what is after it counts from there."""
    segment = segment_of(attitude, 0.0, 24.0)
    t = segment.t_attitude.copy()
    t[len(t) // 2 :] += 3600.0
    late = np.where(segment.t > 12.0, segment.t + 3600.0, segment.t)
    _, got = GyroScale().remembers(replace(segment, t=late, t_attitude=t), None)
    assert np.all(np.isfinite(got))
    assert np.abs(got).max() < 5.0
