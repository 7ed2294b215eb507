"""Angles stand for their matrices, whichever of them are asked for."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.inputs.reported_attitude import ReportedAttitude
from onboard.core.inputs.segments import Segment
from onboard.core.maths.compiling import prefer_compiled, preferred
from onboard.core.maths.frames import (
    euler_from_rotation,
    rotation_from_euler,
    rotation_from_vector,
    untrimmed_rotation,
    untrimmed_rotation_dcm,
)

TRIM = (0.02, -0.03, 0.0)


@pytest.fixture
def angles():
    return np.random.default_rng(2).uniform(-1.0, 1.0, (50, 3))


@pytest.fixture(params=[False, True], ids=["numpy", "compiled"])
def _either_way(request):
    before = preferred()
    prefer_compiled(yes=request.param)
    yield
    prefer_compiled(yes=before)


def test_all_or_some_are_those_of_the_angles(angles):
    by_ekf = untrimmed_rotation(*angles.T, TRIM, 0.05)
    some = np.arange(50) % 3 == 0
    made = ReportedAttitude(angles, TRIM, 0.05)
    assert len(made) == 50
    np.testing.assert_array_equal(made[:], by_ekf)
    np.testing.assert_array_equal(made[some], by_ekf[some])
    by_dcm = untrimmed_rotation_dcm(*angles.T, TRIM)
    np.testing.assert_array_equal(ReportedAttitude(angles, TRIM, dcm_gain=0.2)[some], by_dcm[some])


@pytest.mark.usefixtures("_either_way")
@pytest.mark.parametrize("count", [1, 2, 50])
def test_between_samples_it_is_that_of_the_matrices(angles, count):
    t = np.arange(0.0, 6.0, 0.02)
    w_b = np.random.default_rng(3).normal(size=(len(t), 3))
    reported = ReportedAttitude(angles[:count], TRIM)
    segment = Segment(t, w_b, w_b, np.arange(count) * 0.1 + 0.3, reported, np.eye(3))
    at = np.array([0.1, 0.3, 0.9, 0.93, 0.9999, 2.0, 2.55, 5.2, 5.9])
    R, near = segment.attitude_at(at, 0.03)
    as_matrices, also_near = replace(segment, R_attitude=reported[:]).attitude_at(at, 0.03)
    np.testing.assert_array_equal(R, as_matrices)
    np.testing.assert_array_equal(near, also_near)


def test_a_quaternion_s_trim_is_a_turn_of_the_body(angles):
    trim = (0.1, -0.15, 0.0)
    body = rotation_from_euler(*angles.T)
    told = euler_from_rotation(body @ rotation_from_vector(-np.array(trim)))
    reported = ReportedAttitude(np.stack(told, axis=-1), trim, turned=True)
    np.testing.assert_allclose(reported[:], body, atol=1e-12)
