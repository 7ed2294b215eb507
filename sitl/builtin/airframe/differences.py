"""In which effects of the catalogue an aircraft differs from ArduPilot's nominal one.

Names are those of the project's catalogue of effects at vehicle level; values are the real ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sitl.builtin.airframe.air import profile
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.trajectory import Trajectory

SAME = 1e-6
ENDS = 4000
"""Samples after lift-off and before touch-down: a vehicle on the ground feels no wind."""


def differences(
    aircraft: Aircraft, flight: Trajectory | None = None
) -> dict[str, dict[str, float]]:
    """Unknowns of each effect that is there, by the effect's name.

    ``rotor_drag`` in 1/s; ``body_drag`` as ``areaCd / mass``, m^2/kg; ``wind`` in m/s towards north
    and east, at the flight's mean height where a flight is given; ``thrust_scale`` as full thrust
    over mass against the nominal; ``thrust_tilt`` forwards and to the right, rad; ``voltage_sag``
    as the share of the voltage's law that holds, which is 1 or 0; ``mass_change`` as the mass after
    a payload was dropped over that before.

    Args:
        aircraft: what flies, where.
        flight: that it flew.
    """
    out = _of_the_air(aircraft, flight)
    craft = aircraft.craft
    found = _of_a_copter(craft) if isinstance(craft, Airframe) else _of_a_plane(craft)
    nominal = _nominal(craft)
    for name, values in found.items():
        if any(abs(value - nominal[name][key]) > SAME for key, value in values.items()):
            out[name] = values
    return out


def _of_the_air(aircraft: Aircraft, flight: Trajectory | None) -> dict[str, dict[str, float]]:
    air = aircraft.air
    out: dict[str, dict[str, float]] = {}
    north, east = air.north, air.east
    if flight is not None and flight.outputs is not None:
        flying = np.flatnonzero(~flight.landed)
        inside = slice(flying[0] + ENDS, flying[-1] - ENDS)
        height = -flight.p_n[inside, 2]
        share = profile(height, air.exponent)
        at_mean = profile(np.mean(height, keepdims=True), air.exponent)[0] / np.mean(share)
        mean = at_mean * flight.outputs.wind_n[inside, :2].mean(axis=0)
        north, east = float(mean[0]), float(mean[1])
    if air.north or air.east:
        out["wind"] = {"north": north, "east": east}
        if air.exponent:
            out["wind_profile"] = {"exponent": air.exponent}
    if air.turbulence:
        out["turbulence"] = {"rms": air.turbulence}
    if air.density_ratio != 1.0:
        out["air_density"] = {"ratio": air.density_ratio}
    return out


def _of_a_copter(frame: Airframe) -> dict[str, dict[str, float]]:
    x, y, z = frame.motor_vector
    return {
        "rotor_drag": {"coefficient": frame.mcoef},
        "body_drag": {"x": 1.0 / frame.bcoef, "y": 1.0 / frame.bcoef},
        "thrust_scale": {"ratio": Airframe().hoverThrOut / frame.hoverThrOut},
        "thrust_curve": {"expo": frame.propExpo},
        "voltage_sag": {"share": 1.0 if frame.battCapacityAh > 0.0 else 0.0},
        "motor_lag": {"time_constant": frame.motor_lag},
        "thrust_tilt": {"x": float(np.arctan2(x, -z)), "y": float(np.arctan2(y, -z))},
        "ground_effect": {"gain": frame.ground_effect},
        "mass_change": {"ratio": frame.mass / (frame.mass + frame.payload)},
    }


def _of_a_plane(wing: Wing) -> dict[str, dict[str, float]]:
    # The autopilot's ARSPD_RATIO is 2: a sensor that needs another one reads wrong by the root.
    scale = float(np.sqrt(Wing().airspeed_ratio / wing.airspeed_ratio))
    return {
        "lift": {"c_lift_0": wing.c_lift_0, "c_lift_a": wing.c_lift_a},
        "drag": {"c_drag_p": wing.c_drag_p},
        "side_force": {"c_y_b": wing.c_y_b},
        "thrust_scale": {"ratio": Wing().hover_throttle / wing.hover_throttle},
        "airspeed_scale": {"scale": scale},
    }


def _nominal(craft: Airframe | Wing) -> dict[str, Any]:
    return _of_a_copter(Airframe()) if isinstance(craft, Airframe) else _of_a_plane(Wing())
