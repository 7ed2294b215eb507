"""A plane's attitude, thrust and outputs that belong to a velocity, a bank and a wind.

Inverse dynamics: in axes of the air velocity, rolled by the bank, thrust less drag must be the
specific force wanted ahead, side force that to the right and lift that upwards: the first gives the
thrust, the second the sideslip, the third the angle of attack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe.air import SEA_LEVEL_DENSITY
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.smoothing import DT, Array, derivative

ROUNDS = 80
SLOWEST = 11.0
"""Below it the wheels carry, m/s."""
STANDING_PITCH = 0.03
ATTACK = (-0.3, 0.4)
"""Angles of attack that are looked at, rad."""
MOST_SLIP = 0.4
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
    bank: Array,
    *,
    course: Array,
    aloft: Array,
    mass: Array,
    density: Array,
) -> Aloft:
    """Angles and thrust at which the specific force ``f_n`` is that of thrust and air.

    Args:
        wing: the plane.
        f_n: (n, 3) specific force wanted, NED, m/s^2.
        air_n: (n, 3) velocity through the air, NED, m/s.
        bank: (n,) about the air velocity, rad.
        course: (n,) direction of ``air_n`` over ground, also where it stands, rad.
        aloft: (n,) 0 where the wheels carry, 1 where the wing does.
        mass: (n,) kg.
        density: (n,) kg/m^3.
    """
    true_speed = np.linalg.norm(air_n, axis=1)
    speed = np.maximum(true_speed, SLOWEST)
    pressure = 0.5 * density * speed**2
    gamma = climb_angle(air_n)
    W = rotation.about_z(course) @ rotation.about_y(gamma) @ rotation.about_x(aloft * bank)
    wanted = mass[:, None] * rotation.rotate_back(W, f_n)
    # How fast the air velocity turns: what the yaw damping of the tail feels.
    yawing = derivative(course) * np.cos(gamma) * np.cos(bank) * aloft
    lifted = pressure * wing.s
    alpha = (-wanted[:, 2] / lifted - wing.c_lift_0) / wing.c_lift_a
    beta = np.zeros_like(alpha)
    for _ in range(ROUNDS):
        air_b, rudder, thrust, force = _forces(wing, alpha, beta, yawing, speed, lifted, wanted)
        stiff = lifted * wing.c_lift_a + np.abs(thrust)
        turned = lifted * _side_slope(wing, rudder) + np.abs(thrust)
        rise = (force[:, 2] - wanted[:, 2]) / stiff
        swing = (force[:, 1] - wanted[:, 1]) / turned
        alpha = np.clip(alpha + rise, *ATTACK)
        beta = np.clip(beta + swing, -MOST_SLIP, MOST_SLIP)
        if max(np.max(np.abs(rise)), np.max(np.abs(swing))) < 1e-15:
            break
    alpha = STANDING_PITCH + aloft * (alpha - STANDING_PITCH)
    beta = aloft * beta
    air_b, rudder, thrust, _ = _forces(wing, alpha, beta, yawing, speed, lifted, wanted)
    R = W @ np.swapaxes(from_wind_axes(alpha, beta), 1, 2)
    return Aloft(R, alpha, beta, rudder, speed, thrust, air_b)


def climb_angle(air_n: Array) -> Array:
    """(n,) angle of an air velocity above the horizon, rad; level where it stands."""
    speed = np.maximum(np.linalg.norm(air_n, axis=1), 4.0)
    out: Array = np.arcsin(np.clip(-air_n[:, 2] / speed, -0.9, 0.9))
    return out


def _side_slope(wing: Wing, rudder: Array) -> Array:
    """(n,) how much side force a sideslip makes with the rudder that holds it, per rad."""
    free = np.abs(rudder) < 1.0
    slope = wing.c_y_b - free * wing.c_y_deltar * wing.yaw_stiffness / wing.rudder_power
    out: Array = np.maximum(-slope, 0.05)
    return out


def _forces(
    wing: Wing,
    alpha: Array,
    beta: Array,
    yawing: Array,
    speed: Array,
    lifted: Array,
    wanted: Array,
) -> tuple[Array, Array, Array, Array]:
    """Force of the air (body axes), rudder, thrust, and all force in axes of the air velocity.

    The thrust is what makes the force along the air velocity the wanted one.
    """
    rudder = wing.rudder_for(beta, yawing, speed)
    air_b = wing.force(alpha, beta, rudder, lifted / wing.s)
    B = from_wind_axes(alpha, beta)
    ahead = B[:, :, 0]
    thrust = (wanted[:, 0] - np.einsum("ni,ni->n", air_b, ahead)) / ahead[:, 0]
    force = air_b.copy()
    force[:, 0] += thrust
    return air_b, rudder, thrust, rotation.rotate_back(B, force)


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


def from_wind_axes(alpha: Array, beta: Array) -> Array:
    """(n, 3, 3) body axes from axes with x along the air velocity, by ``atan2`` angles."""
    ahead = np.column_stack([np.ones_like(alpha), np.tan(beta), np.tan(alpha)])
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    right = np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros_like(alpha)])
    right /= np.linalg.norm(right, axis=1)[:, None]
    return np.stack([ahead, right, np.cross(ahead, right)], axis=-1)
