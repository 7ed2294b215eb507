"""The trajectory is a rigid body's: finite differences agree with what sensors would feel."""

import numpy as np
import pytest

from sitl.builtin import rotation
from sitl.builtin.copter import CopterFlight, copter_trajectory
from sitl.builtin.plane import PlaneFlight, plane_trajectory
from sitl.builtin.smoothing import DT
from sitl.builtin.trajectory import Environment, Start, earth_rate_n

ENVIRONMENT = Environment()


def flown(vehicle, seed=1, duration=120.0, **more):
    if vehicle == "plane":
        flight = PlaneFlight(seed=seed, duration=duration, **more)
        return plane_trajectory(flight, ENVIRONMENT, Start((10.0, -5.0, 0.0), 1.0))
    flight = CopterFlight(seed=seed, duration=duration, **more)
    return copter_trajectory(flight, ENVIRONMENT, Start((10.0, -5.0, 0.0), 1.0))


@pytest.fixture(scope="module", params=["plane", "copter"])
def vehicle(request):
    return request.param


@pytest.fixture(scope="module")
def trajectory(vehicle):
    return flown(vehicle)


def test_velocity_differences_equal_specific_force_plus_gravity(trajectory):
    force = rotation.rotate(trajectory.R_nb, trajectory.f_b)
    coriolis = np.cross(2.0 * earth_rate_n(ENVIRONMENT), trajectory.v_n)
    acceleration = force + np.array([0.0, 0.0, ENVIRONMENT.gravity]) - coriolis
    mean = 0.5 * (acceleration[1:] + acceleration[:-1])
    difference = np.diff(trajectory.v_n, axis=0) / DT
    # Transport rate (v^2 / R) is the only term left out here.
    assert np.abs(mean - difference)[5:-5].max() < 1e-3


def test_position_differences_equal_velocity(trajectory):
    mean = 0.5 * (trajectory.v_n[1:] + trajectory.v_n[:-1])
    assert np.abs(np.diff(trajectory.p_n, axis=0) / DT - mean).max() < 1e-9


def test_rates_carry_the_attitude_from_one_sample_to_the_next(trajectory):
    w_nb = trajectory.w_b - rotation.rotate_back(
        trajectory.R_nb, np.broadcast_to(earth_rate_n(ENVIRONMENT), trajectory.w_b.shape)
    )
    step = rotation.from_vector(0.5 * (w_nb[1:] + w_nb[:-1]) * DT)
    predicted = trajectory.R_nb[:-1] @ step
    assert np.abs(predicted - trajectory.R_nb[1:])[5:-5].max() < 2e-6


def test_attitudes_are_rotations(trajectory):
    product = np.einsum("nij,nkj->nik", trajectory.R_nb, trajectory.R_nb)
    assert np.abs(product - np.eye(3)).max() < 1e-12
    assert np.linalg.det(trajectory.R_nb[::500]).min() > 0.0


def test_starts_and_ends_standing_on_the_ground(trajectory):
    for end in (0, -1):
        assert np.abs(trajectory.v_n[end]).max() < 1e-6
        assert abs(trajectory.p_n[end, 2]) < 0.05
        assert trajectory.landed[end]
        assert not trajectory.armed[end]
    assert (~trajectory.landed).mean() > 0.5
    assert trajectory.armed[~trajectory.landed].all()


def test_never_below_the_ground(trajectory):
    assert trajectory.p_n[:, 2].max() < 0.1


def test_every_axis_is_excited(vehicle):
    trajectory = flown(vehicle, duration=300.0)
    aloft = ~trajectory.landed
    spread = trajectory.f_b[aloft].std(axis=0)
    assert spread.min() > 0.4
    assert spread[2] > 1.0
    euler = rotation.to_euler(trajectory.R_nb[aloft])
    assert euler[:, 0].max() > np.radians(25.0)
    assert euler[:, 0].min() < -np.radians(25.0)
    assert np.abs(euler[:, 0]).max() < np.radians(70.0)
    assert np.histogram(euler[:, 2], bins=8, range=(-np.pi, np.pi))[0].min() > 0


def test_dull_flight_is_dull(vehicle):
    trajectory = flown(vehicle, dull=True)
    middle = trajectory.f_b[55_000:80_000]
    assert middle.std(axis=0).max() < 0.4


def test_copter_feels_only_drag_along_its_rotor_plane():
    trajectory = flown("copter", gusts=0.0)
    air_b = rotation.rotate_back(trajectory.R_nb, trajectory.v_n - np.array(ENVIRONMENT.wind_n))[
        40_000:60_000
    ]
    speed = np.linalg.norm(air_b, axis=1)
    k = np.array([0.16, 0.20]) + 0.015 * speed[:, None]
    assert np.abs(trajectory.f_b[40_000:60_000, :2] + k * air_b[:, :2]).max() < 1e-3


def test_stopping_early_changes_nothing_that_was_flown(vehicle):
    whole = flown(vehicle, duration=200.0)
    short = flown(vehicle, duration=200.0, stop_at=70.0)
    assert short.n < whole.n
    assert np.array_equal(short.f_b[:70_000], whole.f_b[:70_000])
    assert abs(short.p_n[-1, 2]) < 0.05


def test_seeds(vehicle):
    assert np.array_equal(flown(vehicle, 7, 60.0).f_b, flown(vehicle, 7, 60.0).f_b)
    assert not np.array_equal(flown(vehicle, 7, 60.0).f_b, flown(vehicle, 8, 60.0).f_b)


def test_single_rotations_are_those_of_many():
    rng = np.random.default_rng(0)
    vectors = np.concatenate([rng.normal(size=(50, 3)), 1e-10 * rng.normal(size=(5, 3))])
    many = rotation.from_vector(vectors)
    for vector, R in zip(vectors, many, strict=True):
        assert np.allclose(rotation.one_from_vector(vector), R, atol=1e-12)
        assert np.allclose(rotation.one_to_euler(R), rotation.to_euler(R), atol=1e-12)
        assert np.allclose(rotation.cross(vector, R[0]), np.cross(vector, R[0]), atol=1e-12)
