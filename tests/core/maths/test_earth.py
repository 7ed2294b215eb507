"""The earth model against published values, limits, and an ECEF model written independently."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.maths import earth

latitude = st.floats(-1.4, 1.4)
height = st.floats(-100, 10_000)
speed = st.floats(-300, 300)


def ecef(lat: float, lon: float, h: float) -> np.ndarray:
    """Earth-centred coordinates from the ellipsoid's equation, with a and b only."""
    a, b = 6378137.0, 6356752.314245
    n = a**2 / np.hypot(a * np.cos(lat), b * np.sin(lat))
    return np.array(
        [
            (n + h) * np.cos(lat) * np.cos(lon),
            (n + h) * np.cos(lat) * np.sin(lon),
            (n * (b / a) ** 2 + h) * np.sin(lat),
        ]
    )


def ned_axes(lat: float, lon: float) -> np.ndarray:
    """Columns: north, east, down in earth-centred axes."""
    down = -np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    return np.stack([np.cross(east, down), east, down], axis=1)


def test_radii_at_equator_and_pole():
    a, b = 6378137.0, 6356752.314245
    meridian, transverse = earth.radii_of_curvature(np.array([0.0, np.pi / 2]))
    assert meridian == pytest.approx([b**2 / a, a**2 / b], rel=1e-10)
    assert transverse == pytest.approx([a, a**2 / b], rel=1e-10)


@given(latitude, height)
def test_radii_are_the_speed_of_latitude_and_longitude(lat, h):
    step = 1e-6
    meridian, transverse = earth.radii_of_curvature(lat)
    north = np.linalg.norm(ecef(lat + step, 0.3, h) - ecef(lat - step, 0.3, h)) / (2 * step)
    east = np.linalg.norm(ecef(lat, 0.3 + step, h) - ecef(lat, 0.3 - step, h)) / (2 * step)
    assert north == pytest.approx(meridian + h, rel=1e-7)
    assert east == pytest.approx((transverse + h) * np.cos(lat), rel=1e-7)


@given(latitude)
def test_earth_rate_is_about_the_polar_axis(lat):
    rate = ned_axes(lat, 0.7) @ earth.earth_rate_n(lat)
    assert np.allclose(rate, [0, 0, 7.292115e-5], atol=1e-18)


@given(latitude, height, speed, speed)
def test_transport_rate_turns_the_local_axes(lat, h, v_north, v_east):
    meridian, transverse = earth.radii_of_curvature(lat)
    step = 1.0
    d_lat = v_north / (meridian + h) * step
    d_lon = v_east / ((transverse + h) * np.cos(lat)) * step
    before, after = ned_axes(lat - d_lat / 2, -d_lon / 2), ned_axes(lat + d_lat / 2, d_lon / 2)
    turn = before.T @ after  # about I + skew(rate) step
    rate = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    v_n = np.array([v_north, v_east, 0.0])
    assert np.allclose(earth.transport_rate_n(lat, h, v_n), rate, rtol=1e-6, atol=1e-12)


@given(latitude, height, speed, speed, st.floats(-50, 50))
def test_coriolis_is_the_acceleration_that_a_free_body_shows_in_ned(
    lat, h, v_north, v_east, v_down
):
    """A body that moves straight in inertial space, seen from the turning NED frame.

    Gravity as NED knows it contains the centrifugal part; take it off both sides.
    """
    v_n = np.array([v_north, v_east, v_down])
    spin = np.array([0, 0, 7.292115e-5])
    position, axes = ecef(lat, 0.0, h), ned_axes(lat, 0.0)
    inertial_velocity = axes @ v_n + np.cross(spin, position)
    # d/dt in earth axes of the earth-relative velocity of an unaccelerated body:
    relative_acceleration = -2 * np.cross(spin, axes @ v_n) - np.cross(
        spin, np.cross(spin, position)
    )
    assert np.linalg.norm(inertial_velocity) > 0
    centrifugal = -np.cross(spin, np.cross(spin, position))
    in_ned = axes.T @ (relative_acceleration - centrifugal)
    in_ned -= np.cross(earth.transport_rate_n(lat, h, v_n), v_n)
    assert np.allclose(earth.coriolis_n(lat, h, v_n), in_ned, atol=1e-12)


def test_coriolis_deflects_to_the_right_in_the_north_and_does_no_work():
    eastward = earth.coriolis_n(0.8, 0.0, [0.0, 20.0, 0.0])
    assert eastward[0] < 0
    assert eastward[0] == pytest.approx(-2 * 7.292115e-5 * np.sin(0.8) * 20, rel=0.05)
    v = np.array([13.0, -5.0, 2.0])
    assert earth.coriolis_n(0.8, 100.0, v) @ v == pytest.approx(0, abs=1e-15)
