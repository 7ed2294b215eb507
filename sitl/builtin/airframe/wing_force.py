"""A plane's attitude, thrust and outputs that belong to a velocity, a sideslip and a wind.

Inverse dynamics: in axes of the air velocity, rolled by the bank, thrust less drag must be the
specific force wanted ahead, side force that to the right and lift that upwards: the first gives the
thrust, the second the bank, the third the angle of attack.  The bank and not the sideslip, since
lift can be leant to any side, and side force may be too weak to be of use: the rudder that holds a
sideslip takes half of the nominal plane's away again, and all of it from one with half as much.
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
MOST_SLIP = 1.2
"""Sideslip that is looked at, rad: from a right angle on there is no air from ahead."""
EASE = 0.05
"""Sideslip that is as little asked for as a radian of bank: where a push-over leaves no lift to be
leant, a little sideslip makes the side force."""
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
    *,
    bank: Array,
    slip: Array,
    course: Array,
    steered: Array,
    aloft: Array,
    mass: Array,
    density: Array,
) -> Aloft:
    """Angles and thrust at which the specific force ``f_n`` is that of thrust and air.

    Args:
        wing: the plane.
        f_n: (n, 3) specific force wanted, NED, m/s^2.
        air_n: (n, 3) velocity through the air, NED, m/s.
        bank: (n,) about the air velocity, rad: where the search begins.
        slip: (n,) sideslip that the rudder holds, as far as it can, rad.
        course: (n,) direction of ``air_n`` over ground, also where it stands, rad.
        steered: (n,) where that would be without gusts, rad: they turn the air and not the nose.
        aloft: (n,) 0 where the wheels carry, 1 where the wing does.
        mass: (n,) kg.
        density: (n,) kg/m^3.
    """
    speed = np.maximum(np.linalg.norm(air_n, axis=1), SLOWEST)
    lifted = 0.5 * density * speed**2 * wing.s
    gamma = climb_angle(air_n)
    level = rotation.about_z(course) @ rotation.about_y(gamma)
    wanted = mass[:, None] * rotation.rotate_back(level, f_n)
    # How fast the path turns, seen by a plane that leans: what the yaw damping of the tail feels.
    yawing = derivative(steered) * np.cos(gamma) * np.cos(bank) * aloft
    held, rudder = wing.held_slip(slip, yawing, speed)
    gusty = np.arctan2(np.sin(course - steered), np.cos(course - steered))
    beta = aloft * np.clip(held + gusty, -MOST_SLIP, MOST_SLIP)
    bank = aloft * bank
    alpha = (-wanted[:, 2] / lifted - wing.c_lift_0) / wing.c_lift_a
    for _ in range(ROUNDS):
        air_b, thrust, force = _forces(wing, alpha, beta, rudder, lifted, wanted[:, 0])
        right, down = _rolled(wanted, bank)
        stiff = lifted * wing.c_lift_a + np.abs(thrust)
        rise = (force[:, 2] - down) / stiff
        lean, swing = _sideways(right - force[:, 1], down, lifted * wing.c_y_b - np.abs(thrust))
        alpha = np.clip(alpha + rise, *ATTACK)
        bank = bank + aloft * lean
        beta = np.clip(beta + aloft * swing, -MOST_SLIP, MOST_SLIP)
        if np.max(np.abs(aloft * [rise, lean, swing])) < 1e-15:
            break
    alpha = STANDING_PITCH + aloft * (alpha - STANDING_PITCH)
    air_b, thrust, _ = _forces(wing, alpha, beta, rudder, lifted, wanted[:, 0])
    R = level @ rotation.about_x(bank) @ np.swapaxes(from_wind_axes(alpha, beta), 1, 2)
    return Aloft(R, alpha, beta, rudder, speed, thrust, air_b)


def _rolled(force: Array, bank: Array) -> tuple[Array, Array]:
    """To the right and down, of an (n, 3) force in axes that are rolled by (n,) rad."""
    c, s = np.cos(bank), np.sin(bank)
    return c * force[:, 1] + s * force[:, 2], c * force[:, 2] - s * force[:, 1]


def _sideways(missing: Array, down: Array, slope: Array) -> tuple[Array, Array]:
    """(n,) changes of bank and sideslip, rad, that make a side force of ``missing`` N.

    The least that will do, of both: as the force ``down`` and the ``slope`` of the side force by
    sideslip (N and N/rad) let them.
    """
    able = down**2 + (EASE * slope) ** 2
    return -missing * down / able, missing * EASE**2 * slope / able


def climb_angle(air_n: Array) -> Array:
    """(n,) angle of an air velocity above the horizon, rad; level where it stands."""
    speed = np.maximum(np.linalg.norm(air_n, axis=1), 4.0)
    out: Array = np.arcsin(np.clip(-air_n[:, 2] / speed, -0.9, 0.9))
    return out


def _forces(
    wing: Wing, alpha: Array, beta: Array, rudder: Array, lifted: Array, ahead: Array
) -> tuple[Array, Array, Array]:
    """Force of the air (body axes), thrust, and all force in axes of the air velocity.

    The thrust is what makes the force along the air velocity the (n,) one that is wanted, N.
    """
    air_b = wing.force(alpha, beta, rudder, lifted / wing.s)
    B = from_wind_axes(alpha, beta)
    nose = B[:, :, 0]
    thrust = (ahead - np.einsum("ni,ni->n", air_b, nose)) / nose[:, 0]
    force = air_b.copy()
    force[:, 0] += thrust
    return air_b, thrust, rotation.rotate_back(B, force)


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
