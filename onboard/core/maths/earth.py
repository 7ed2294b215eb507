"""The earth under the vehicle: WGS-84 shape, rotation, and what they do to v_n.

Sources: NIMA TR8350.2 (2000), *World Geodetic System 1984*, table 3.1, for the constants;
P. D. Groves, *Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems* (2nd
ed. 2013), chapters 2 and 5, for the rates and the navigation equation.  Latitude and longitude in
rad, heights in m above the ellipsoid (heights above mean sea level do: radii change by 1e-5).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from onboard.core.maths.arrays import Array, Vector3

SEMI_MAJOR_AXIS: Final = 6378137.0
"""a, m (TR8350.2 table 3.1)."""
FLATTENING: Final = 1 / 298.257223563
"""f (TR8350.2 table 3.1)."""
ECCENTRICITY_SQUARED: Final = FLATTENING * (2 - FLATTENING)
"""e^2 of the first eccentricity."""
EARTH_RATE: Final = 7.292115e-5
"""Angular rate of the earth, rad/s (TR8350.2 table 3.1)."""
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
    carried, turning = carried_and_turning_of(latitude, *v_n.tolist())
    return np.array(carried), np.array(turning)


def carried_and_turning_of(
    latitude: float, north: float, east: float, down: float
) -> tuple[Vector3, Vector3]:
    """The same of plain numbers: in a row of thousands, arrays are most of what it takes."""
    c, s = math.cos(latitude), math.sin(latitude)
    # A sphere's radius does: half a per cent of 1e-6 rad/s.
    w = (east / SEMI_MAJOR_AXIS, -north / SEMI_MAJOR_AXIS, -east * s / c / SEMI_MAJOR_AXIS)
    x, y, z = 2.0 * EARTH_RATE * c + w[0], w[1], -2.0 * EARTH_RATE * s + w[2]
    carried = z * east - y * down, x * down - z * north, y * north - x * east
    return carried, (EARTH_RATE * c + w[0], w[1], -EARTH_RATE * s + w[2])
