"""The earth under the vehicle: WGS-84 shape, normal gravity, rotation, and what they do to v_n.

Sources: NIMA TR8350.2 (2000), *World Geodetic System 1984*, tables 3.1 and 3.4 and section 4,
for the constants and gravity; P. D. Groves, *Principles of GNSS, Inertial, and Multisensor
Integrated Navigation Systems* (2nd ed. 2013), chapters 2 and 5, for the rates and the
navigation equation.  Latitude and longitude in rad, heights in m above the ellipsoid
(heights above mean sea level do: 100 m of geoid are 3e-4 m/s^2 of gravity).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array

SEMI_MAJOR_AXIS: Final = 6378137.0
"""a, m (TR8350.2 table 3.1)."""
FLATTENING: Final = 1 / 298.257223563
"""f (TR8350.2 table 3.1)."""
ECCENTRICITY_SQUARED: Final = FLATTENING * (2 - FLATTENING)
"""e^2 of the first eccentricity."""
EARTH_RATE: Final = 7.292115e-5
"""Angular rate of the earth, rad/s (TR8350.2 table 3.1)."""
GRAVITY_EQUATOR: Final = 9.7803253359
"""Normal gravity on the ellipsoid at the equator, m/s^2 (TR8350.2 table 3.4)."""
GRAVITY_POLE: Final = 9.8321849378
"""Normal gravity on the ellipsoid at the poles, m/s^2 (TR8350.2 table 3.4)."""
CENTRIFUGAL_RATIO: Final = 0.00344978650684
"""m = w^2 a^2 b / GM (TR8350.2 table 3.4)."""
STANDARD_GRAVITY: Final = 9.80665
"""What ArduPilot's EKF and SITL integrate with, everywhere (3rd CGPM, 1901), m/s^2."""


def radii_of_curvature(latitude: ArrayLike) -> tuple[Array, Array]:
    """Radii of the ellipsoid along the meridian and across it (Groves 2.105, 2.106).

    Args:
        latitude: (...) rad.

    Returns:
        (meridian, transverse), each (...) m.
    """
    s2 = np.sin(np.asarray(latitude, dtype=np.float64)) ** 2
    w = 1 - ECCENTRICITY_SQUARED * s2
    transverse = SEMI_MAJOR_AXIS / np.sqrt(w)
    meridian = transverse * (1 - ECCENTRICITY_SQUARED) / w
    return np.asarray(meridian), np.asarray(transverse)


def normal_gravity(latitude: ArrayLike, height: ArrayLike = 0.0) -> Array:
    """Somigliana's formula with the height series (TR8350.2 equations 4-1 and 4-3).

    Args:
        latitude: (...) rad.
        height: (...) m.

    Returns:
        (...) m/s^2, positive down.  Real gravity is within about 1e-3 of it.
    """
    s2 = np.sin(np.asarray(latitude, dtype=np.float64)) ** 2
    h = np.asarray(height, dtype=np.float64) / SEMI_MAJOR_AXIS
    k = (1 - FLATTENING) * GRAVITY_POLE / GRAVITY_EQUATOR - 1
    surface = GRAVITY_EQUATOR * (1 + k * s2) / np.sqrt(1 - ECCENTRICITY_SQUARED * s2)
    factor = 1 - 2 * (1 + FLATTENING + CENTRIFUGAL_RATIO - 2 * FLATTENING * s2) * h + 3 * h**2
    return np.asarray(surface * factor)


def earth_rate_n(latitude: ArrayLike) -> Array:
    """(..., 3) rotation of the earth against inertial space, in NED, rad/s."""
    lat = np.asarray(latitude, dtype=np.float64)
    return EARTH_RATE * np.stack([np.cos(lat), np.zeros_like(lat), -np.sin(lat)], axis=-1)


def transport_rate_n(latitude: ArrayLike, height: ArrayLike, v_n: ArrayLike) -> Array:
    """Turning of the local NED frame as the vehicle travels over the ellipsoid (Groves 5.44).

    Args:
        latitude: (...) rad, away from the poles, where NED itself is singular.
        height: (...) m.
        v_n: (..., 3) m/s.

    Returns:
        (..., 3) rad/s in NED.
    """
    lat = np.asarray(latitude, dtype=np.float64)
    h = np.asarray(height, dtype=np.float64)
    v = np.asarray(v_n, dtype=np.float64)
    meridian, transverse = radii_of_curvature(lat)
    north_south = -v[..., 0] / (meridian + h)
    about_north = v[..., 1] / (transverse + h)
    return np.stack([about_north, north_south, -about_north * np.tan(lat)], axis=-1)


def coriolis_n(latitude: ArrayLike, height: ArrayLike, v_n: ArrayLike) -> Array:
    """What the turning of earth and of NED adds to ``dv_n/dt``: ``-(2 w_ie + w_en) x v``.

    So that ``dv_n/dt = R_nb f_b + (0, 0, g) + coriolis_n(...)`` (Groves 5.53); about 3 mm/s^2
    at 20 m/s.  A simulator on a flat, still earth (ArduPilot's SITL) does not have it.

    Args:
        latitude: (...) rad.
        height: (...) m.
        v_n: (..., 3) m/s.

    Returns:
        (..., 3) m/s^2 in NED.
    """
    rate = 2 * earth_rate_n(latitude) + transport_rate_n(latitude, height, v_n)
    return np.asarray(-np.cross(rate, np.asarray(v_n, dtype=np.float64)))


def carried_and_turning(latitude: float, v_n: Array) -> tuple[Array, Array]:
    """:func:`coriolis_n` and the turning of NED for one vector, at a tenth of the cost.

    Args:
        latitude: rad.
        v_n: (3,) m/s.

    Returns:
        (3,) m/s^2 and (3,) rad/s, both in NED.
    """
    north, east, down = (float(x) for x in v_n)
    c, s = np.cos(latitude), np.sin(latitude)
    # A sphere's radius does: half a per cent of 1e-6 rad/s.
    w = (east / SEMI_MAJOR_AXIS, -north / SEMI_MAJOR_AXIS, -east * s / c / SEMI_MAJOR_AXIS)
    x, y, z = 2.0 * EARTH_RATE * c + w[0], w[1], -2.0 * EARTH_RATE * s + w[2]
    carried = np.array([z * east - y * down, x * down - z * north, y * north - x * east])
    return carried, np.array([EARTH_RATE * c + w[0], w[1], -EARTH_RATE * s + w[2]])


def displacement_n(
    latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike, origin: tuple[float, float, float]
) -> Array:
    """North, east, down from ``origin`` along the surface of the earth.

    The third component is minus the difference in *height*, as the integral of ``v_d`` is: it
    does not sink below the horizon as a tangent plane's would (0.8 m at 3 km).

    Args:
        latitude: (...) rad.
        longitude: (...) rad.
        height: (...) m.
        origin: latitude (rad), longitude (rad), height (m).

    Returns:
        (..., 3) m.  North and east on a sphere depend on the path: the integral of ``v_n``
        differs by about north times east times tan(latitude) / 6.4e6 m.
    """
    lat = np.asarray(latitude, dtype=np.float64)
    lon = np.asarray(longitude, dtype=np.float64)
    h = np.asarray(height, dtype=np.float64)
    middle = 0.5 * (lat + origin[0])
    mean_height = 0.5 * (h + origin[2])
    meridian, transverse = radii_of_curvature(middle)
    eastward = np.remainder(lon - origin[1] + np.pi, 2 * np.pi) - np.pi
    return np.stack(
        [
            (meridian + mean_height) * (lat - origin[0]),
            (transverse + mean_height) * np.cos(middle) * eastward,
            origin[2] - h,
        ],
        axis=-1,
    )
