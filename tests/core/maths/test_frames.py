"""Rotations against identities, and ArduPilot's list of orientations against its own algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onboard.core.maths import board_orientation, frames

ROUNDING = 1e-12
angle = st.floats(-np.pi, np.pi)
vector = arrays(np.float64, 3, elements=st.floats(-3, 3))


def about(axis: int, angle: float) -> np.ndarray:
    """Elementary right-handed rotation, written independently of the module."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[j, i], R[i, j] = s, -s
    return R


@given(angle, angle, angle)
def test_euler_is_yaw_after_pitch_after_roll(roll, pitch, yaw):
    R = frames.rotation_from_euler(roll, pitch, yaw)
    assert np.allclose(R, about(2, yaw) @ about(1, pitch) @ about(0, roll), atol=ROUNDING)


def test_euler_meaning_of_the_signs():
    nose_up = frames.rotation_from_euler(0, 0.3, 0) @ [1, 0, 0]
    assert nose_up[2] < 0  # z is down
    right_wing_down = frames.rotation_from_euler(0.3, 0, 0) @ [0, 1, 0]
    assert right_wing_down[2] > 0
    nose_east = frames.rotation_from_euler(0, 0, np.pi / 2) @ [1, 0, 0]
    assert np.allclose(nose_east, [0, 1, 0], atol=ROUNDING)


@given(angle, st.floats(-1.57, 1.57), angle)
def test_euler_round_trip(roll, pitch, yaw):
    R = frames.rotation_from_euler(roll, pitch, yaw)
    assert np.allclose(frames.rotation_from_euler(*frames.euler_from_rotation(R)), R, atol=ROUNDING)
    if abs(pitch) < 1.5:
        r, p, y = frames.euler_from_rotation(R)
        assert np.allclose(
            np.exp(1j * np.array([r, p, y])), np.exp(1j * np.array([roll, pitch, yaw]))
        )


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_euler_gives_the_matrix_back_at_the_singularity(pitch):
    R = frames.rotation_from_euler(0.4, pitch, -1.1)
    assert np.allclose(frames.rotation_from_euler(*frames.euler_from_rotation(R)), R, atol=ROUNDING)


def test_all_functions_keep_leading_dimensions():
    rng = np.random.default_rng(1)
    phi = rng.normal(size=(4, 5, 3))
    R = frames.rotation_from_vector(phi)
    assert R.shape == (4, 5, 3, 3)
    assert np.allclose(R[2, 3], frames.rotation_from_vector(phi[2, 3]))
    assert np.allclose(frames.vector_from_rotation(R)[1, 2], frames.vector_from_rotation(R[1, 2]))
    assert np.allclose(frames.rotation_from_quaternion(frames.quaternion_from_rotation(R)), R)
    roll, pitch, yaw = frames.euler_from_rotation(R)
    assert np.allclose(frames.rotation_from_euler(roll, pitch, yaw), R)
    assert frames.skew(phi).shape == (4, 5, 3, 3)


@given(vector, vector)
def test_skew_is_the_cross_product(a, b):
    assert np.allclose(frames.skew(a) @ b, np.cross(a, b), atol=ROUNDING)


@given(vector)
def test_exponential_is_a_rotation_about_its_vector(phi):
    R = frames.rotation_from_vector(phi)
    assert np.allclose(R @ R.T, np.eye(3), atol=ROUNDING)
    assert np.linalg.det(R) == pytest.approx(1)
    assert np.allclose(R @ phi, phi, atol=ROUNDING)
    assert np.trace(R) == pytest.approx(1 + 2 * np.cos(np.linalg.norm(phi)), abs=ROUNDING)


@given(vector, st.sampled_from([0.0, 1e-300, 1e-15, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-7]))
def test_logarithm_undoes_the_exponential(direction, size):
    norm = np.linalg.norm(direction)
    if norm < 1e-3:
        return
    phi = direction / norm * size
    back = frames.vector_from_rotation(frames.rotation_from_vector(phi))
    assert np.allclose(back, phi, rtol=1e-9, atol=1e-14)


@given(vector)
def test_logarithm_at_a_half_turn_gives_the_matrix_back(direction):
    norm = np.linalg.norm(direction)
    if norm < 1e-3:
        return
    u = direction / norm
    R = 2 * np.outer(u, u) - np.eye(3)
    phi = frames.vector_from_rotation(R)
    assert np.linalg.norm(phi) == pytest.approx(np.pi)
    assert np.allclose(frames.rotation_from_vector(phi), R, atol=1e-9)


def test_interpolation_turns_at_constant_rate_and_holds_at_the_ends():
    w = np.array([0.2, -0.5, 0.9])
    times = np.array([0.0, 0.4, 1.0])
    R0 = frames.rotation_from_euler(0.1, 0.2, 3.1)
    R = R0 @ frames.rotation_from_vector(times[:, None] * w)
    at = np.array([-1.0, 0.0, 0.1, 0.4, 0.7, 1.0, 2.0])
    expected = R0 @ frames.rotation_from_vector(np.clip(at, 0, 1)[:, None] * w)
    assert np.allclose(frames.interpolate_rotation(at, times, R), expected, atol=ROUNDING)
    assert np.allclose(frames.interpolate_rotation(at, times[:1], R[:1]), R[0])


def test_every_board_orientation_is_a_rotation_and_the_90_degree_ones_are_exact():
    aligned = set()
    for value in range(44):
        R = board_orientation.board_rotation(value)
        assert R is not None
        assert np.allclose(R @ R.T, np.eye(3), atol=ROUNDING)
        assert np.linalg.det(R) == pytest.approx(1)
        if board_orientation.is_axis_aligned(R):
            aligned.add(tuple(R.astype(int).ravel()))
            assert set(np.unique(R)) <= {-1.0, 0.0, 1.0}
    assert len(aligned) == 24  # all rotations of the cube are in the list


def test_board_orientations_that_the_autopilot_documents_as_the_same():
    assert np.array_equal(
        board_orientation.board_rotation(26), board_orientation.board_rotation(14)
    )
    assert np.array_equal(
        board_orientation.board_rotation(27), board_orientation.board_rotation(10)
    )


@pytest.mark.parametrize(
    ("value", "f_s", "f_b"),
    [  # the autopilot's Vector3::rotate(), written out by hand
        (2, [1, 2, 3], [-2, 1, 3]),  # yaw 90: x = -y, y = x
        (8, [1, 2, 3], [1, -2, -3]),
        (16, [1, 2, 3], [1, -3, 2]),  # roll 90: y = -z, z = y
        (24, [1, 2, 3], [3, 2, -1]),  # pitch 90: x = z, z = -x
        (28, [1, 2, 3], [2, -3, -1]),  # roll 90, then pitch 90
        (36, [1, 2, 3], [3, -1, -2]),  # roll 90, pitch 180, yaw 90
    ],
)
def test_board_orientation_takes_sensor_to_body(value, f_s, f_b):
    assert np.array_equal(board_orientation.board_rotation(value) @ f_s, f_b)


def test_board_orientation_with_odd_angles_uses_the_real_ones():
    R = board_orientation.board_rotation(38)
    assert R is not None
    assert R[2, 0] == pytest.approx(-0.93232380, abs=1e-7)
    assert R[0, 2] == pytest.approx(-0.91844638, abs=1e-7)
    assert not board_orientation.is_axis_aligned(R)


@pytest.mark.parametrize("value", [-1, 44, 99, 100, 101, 102, 103, 2.5, float("nan"), float("inf")])
def test_unknown_board_orientation_is_none(value):
    assert board_orientation.board_rotation(value) is None


def test_custom_board_orientation_needs_its_angles():
    R = board_orientation.board_rotation(101.0, custom=(0.0, 0.0, np.pi / 2))
    assert np.allclose(R, about(2, np.pi / 2), atol=ROUNDING)
    assert board_orientation.is_axis_aligned(R)


def test_a_projection_or_a_shear_is_not_axis_aligned():
    assert not board_orientation.is_axis_aligned(np.array([[1, 0, 0], [1, 0, 0], [0, 0, 1.0]]))
    assert not board_orientation.is_axis_aligned(frames.rotation_from_euler(0, 0, 1e-6))


@given(st.floats(-1.4, 1.4), st.floats(-1.2, 1.2), angle)
def test_trim_of_the_ekf_is_undone_angle_by_angle(roll, pitch, yaw):
    trim, pitch_trim = (0.03, -0.05, 0.01), 0.02
    reported = roll - trim[0], pitch - trim[1] - pitch_trim, yaw - trim[2]
    R = frames.untrimmed_rotation(*reported, trim=trim, pitch_trim=pitch_trim)
    assert np.allclose(R, frames.rotation_from_euler(roll, pitch, yaw), atol=ROUNDING)


@given(st.floats(-1.4, 1.4), st.floats(-1.2, 1.2), angle)
def test_trim_of_dcm_is_undone_as_a_rotation(roll, pitch, yaw):
    trim = (0.03, -0.05, 0.0)
    truth = frames.rotation_from_euler(roll, pitch, yaw)
    reported = frames.euler_from_rotation(truth @ frames.rotation_from_euler(*trim).T)
    assert np.allclose(frames.untrimmed_rotation_dcm(*reported, trim=trim), truth, atol=ROUNDING)


def test_the_two_trims_differ_in_a_bank_by_the_size_of_the_trim():
    trim = (0.0, 0.02, 0.0)
    level = [
        f(0.0, 0.0, 0.0, trim=trim)
        for f in (frames.untrimmed_rotation, frames.untrimmed_rotation_dcm)
    ]
    assert np.allclose(level[0], level[1], atol=ROUNDING)
    banked = [
        f(1.05, 0.0, 0.0, trim=trim)
        for f in (frames.untrimmed_rotation, frames.untrimmed_rotation_dcm)
    ]
    between = frames.vector_from_rotation(banked[0].T @ banked[1])
    assert np.linalg.norm(between) == pytest.approx(0.02, rel=0.1)
