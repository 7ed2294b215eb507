"""A plane's attitude, thrust and outputs that belong to a velocity, a sideslip and a wind.

Inverse dynamics: along the air velocity thrust less drag must be the specific force wanted, across
it lift and side force must; the first gives the thrust, the second angle of attack and bank.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe.air import SEA_LEVEL_DENSITY
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.smoothing import DT, Array, derivative

ROUNDS = 30
SLOWEST = 11.0
"""Below it the wheels carry, m/s."""
STANDING_PITCH = 0.03
ATTACK = (-0.3, 0.4)
"""Angles of attack that are looked at, rad."""
WEIGHTLESS = 0.1
"""With less load than this (g) nothing tells how it banks: it goes from before to after."""
VOLTAGE, SAG, FULL_CURRENT = 12.6, 0.7, 50.0
"""Battery of ArduPilot's simulated plane: V, V and A at full throttle."""
CENTRE, HALF = 1500.0, 500.0


@dataclass(frozen=True, slots=True)
class Aloft:
    """Where forces balance: (n, 3, 3) attitude; (n,) angles in rad; thrust and air force, N."""

    R_nb: Array
    alpha: Array
    beta: Array
    rudder: Array
    speed: Array
    thrust: Array
    air_b: Array


def balanced(
    wing: Wing,
    f_n: Array,
    air_n: Array,
    beta: Array,
    *,
    course: Array,
    aloft: Array,
    mass: Array,
    density: Array,
) -> Aloft:
    """Attitude and thrust at which the specific force ``f_n`` is that of thrust and air.

    Args:
        wing: the plane.
        f_n: (n, 3) specific force wanted, NED, m/s^2.
        air_n: (n, 3) velocity through the air, NED, m/s.
        beta: (n,) sideslip, rad.
        course: (n,) direction of ``air_n`` over ground, also where it stands, rad.
        aloft: (n,) 0 where the wheels carry, 1 where the wing does.
        mass: (n,) kg.
        density: (n,) kg/m^3.
    """
    true_speed = np.linalg.norm(air_n, axis=1)
    speed = np.maximum(true_speed, SLOWEST)
    pressure = 0.5 * density * speed**2
    gamma = np.arcsin(np.clip(-air_n[:, 2] / np.maximum(true_speed, 4.0), -0.9, 0.9))
    W = rotation.about_z(course) @ rotation.about_y(gamma)
    wanted = mass[:, None] * rotation.rotate_back(W, f_n)
    across = np.hypot(wanted[:, 1], wanted[:, 2])
    # How fast the air velocity turns about the lift: what the yaw damping of the tail feels.
    turning = derivative(course) * np.cos(gamma) * aloft
    bank = np.arctan2(turning * speed, 9.80665)
    rudder = wing.rudder_for(beta, turning * np.cos(bank), speed)

    def sized(alpha: Array) -> tuple[Array, Array, Array]:
        """Force of the air, thrust, and force in axes of the air velocity, rolled with the body."""
        air_b = wing.force(alpha, beta, rudder, pressure)
        B = _from_wind_axes(alpha, beta)
        ahead = B[:, :, 0]
        thrust = (wanted[:, 0] - np.einsum("ni,ni->n", air_b, ahead)) / ahead[:, 0]
        force = air_b.copy()
        force[:, 0] += thrust
        return air_b, thrust, rotation.rotate_back(B, force)

    alpha = (across / (pressure * wing.s) - wing.c_lift_0) / wing.c_lift_a
    slope = pressure * wing.s * wing.c_lift_a
    step = np.full_like(alpha, 1e-6)
    miss = np.hypot(*sized(alpha - step)[2][:, 1:].T) - across
    for _ in range(ROUNDS):  # the secant, sample by sample
        new = np.hypot(*sized(alpha)[2][:, 1:].T) - across
        moved = np.abs(step) > 1e-9
        slope = np.where(moved, (new - miss) / np.where(moved, step, 1.0), slope)
        slope = np.maximum(slope, 1.0)
        step = np.clip(-new / slope, -0.2, 0.2)
        miss = new
        alpha = np.clip(alpha + step, *ATTACK)
        if np.max(np.abs(step)) < 1e-14:
            break
    force = sized(alpha)[2]
    roll = np.arctan2(wanted[:, 2], wanted[:, 1]) - np.arctan2(force[:, 2], force[:, 1])
    known = across > WEIGHTLESS * 9.80665 * mass
    roll = _bridged(np.unwrap(roll[known]), known)
    alpha = _bridged(alpha[known], known)
    alpha = STANDING_PITCH + aloft * (alpha - STANDING_PITCH)
    air_b, thrust, _ = sized(alpha)
    R = W @ rotation.about_x(aloft * roll) @ np.swapaxes(_from_wind_axes(alpha, aloft * beta), 1, 2)
    return Aloft(R, alpha, beta, rudder, speed, thrust, air_b)


def outputs(
    wing: Wing,
    aloft: Aloft,
    *,
    w_b: Array,
    air_n: Array,
    wind_n: Array,
    density: Array,
    mass: Array,
    powered: Array,
    indicated_error: Array,
    told_wind: Array,
    configured_ratio: float,
) -> Outputs:
    """What servos, battery and airspeed sensor do at a balance.

    Args:
        wing: the plane.
        aloft: of every sample.
        w_b: (n, 3) body rates, rad/s.
        air_n: (n, 3) velocity through the air, m/s.
        wind_n: (n, 3) m/s.
        density: (n,) kg/m^3.
        mass: (n,) kg.
        powered: (n,) whether the motor may run.
        indicated_error: (n,) noise of the airspeed sensor, m/s.
        told_wind: (n, 2) wind that the autopilot believes in, m/s.
        configured_ratio: ARSPD_RATIO of the autopilot.
    """
    throttle = np.clip(aloft.thrust / wing.full_thrust, 0.0, 1.0) * powered
    surfaces = (
        wing.aileron_for(aloft.beta, w_b, aloft.speed),
        wing.elevator_for(aloft.alpha, w_b[:, 1], aloft.speed),
        aloft.rudder,
    )
    aileron, elevator, rudder = (CENTRE + HALF * x for x in surfaces)
    current = np.maximum(FULL_CURRENT * throttle**2, 0.4)
    charge = np.cumsum(current) * (DT / 3.6)
    # Pressure is that of the equivalent airspeed.
    equivalent = np.linalg.norm(air_n, axis=1) * np.sqrt(density / SEA_LEVEL_DENSITY)
    thrust_b = np.zeros_like(w_b)
    thrust_b[:, 0] = throttle * wing.full_thrust
    return Outputs(
        pwm=np.column_stack([aileron, elevator, 1000.0 + 1000.0 * throttle, rudder]),
        voltage=VOLTAGE - SAG * throttle,
        current=current,
        consumed=charge,
        indicated=equivalent * np.sqrt(configured_ratio / wing.airspeed_ratio) + indicated_error,
        told_wind=told_wind,
        wind_n=wind_n,
        density=density,
        mass=mass,
        thrust_b=thrust_b,
        drag_b=aloft.air_b,
    )


def _bridged(values: Array, known: np.ndarray[Any, np.dtype[np.bool_]]) -> Array:
    """(n,) values where known, straight lines in between."""
    if not len(values):
        return np.zeros(len(known))
    out: Array = np.interp(np.arange(len(known)), np.flatnonzero(known), values)
    return out


def _from_wind_axes(alpha: Array, beta: Array) -> Array:
    """(n, 3, 3) body axes from axes with x along the air velocity, by ``atan2`` angles."""
    ahead = np.column_stack([np.ones_like(alpha), np.tan(beta), np.tan(alpha)])
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    right = np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros_like(alpha)])
    right /= np.linalg.norm(right, axis=1)[:, None]
    return np.stack([ahead, right, np.cross(ahead, right)], axis=-1)
