"""A multicopter's attitude, thrust and outputs that belong to a velocity, a heading and a wind.

Inverse dynamics: ``m f_n = R (T t_b - D_b(u_b, T))`` with ``u_b = R^T (v_n - w_n)`` is solved for
the attitude R (of a given heading) and the thrust T at every millisecond; motors and battery
follow.  D is ArduPilot's: momentum drag ``c sqrt(rho A T) u`` and drag of the body
``(rho/2) areaCd |u| u``, axis by axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.airframe import motors
from sitl.builtin.airframe.air import SEA_LEVEL_DENSITY
from sitl.builtin.airframe.battery import discharge
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.smoothing import Array, derivative

ROUNDS = 100
SPIN_ARM = 0.1
AVIONICS_W = 4.0
GAP = 0.1
"""Rotors of a vehicle that stands are so high above the ground, m."""


@dataclass(frozen=True, slots=True)
class Balance:
    """Where forces balance: (n, 3, 3) attitude, (n,) thrust in N, (n, 3) drag in body axes, N."""

    R_nb: Array
    thrust: Array
    drag_b: Array


def drag(frame: Airframe, u_b: Array, thrust: Array, density: Array) -> Array:
    """(n, 3) force of the air against the body's motion through it, body axes, N."""
    flow = np.sqrt(density * frame.disc_area * np.abs(thrust))
    rotors = frame.momentum_coefficient * flow[:, None] * u_b
    body = (0.5 * frame.area_cd) * density[:, None] * np.abs(u_b) * u_b
    out: Array = -(rotors + body)
    return out


def balanced(
    frame: Airframe, f_n: Array, air_n: Array, yaw: Array, *, mass: Array, density: Array
) -> Balance:
    """Attitude and thrust at which the specific force ``f_n`` is that of thrust and drag.

    Args:
        frame: the vehicle.
        f_n: (n, 3) specific force wanted, NED, m/s^2.
        air_n: (n, 3) velocity through the air, NED, m/s.
        yaw: (n,) heading, rad.
        mass: (n,) kg.
        density: (n,) kg/m^3.
    """
    force_n = mass[:, None] * f_n
    turn = _to_straight_up(np.array(frame.motor_vector))
    length = float(np.linalg.norm(frame.motor_vector))
    R = rotation.about_z(yaw)
    push = np.linalg.norm(force_n, axis=1)
    drag_b = np.zeros_like(f_n)
    left = np.arange(len(f_n))
    # Each round leaves about a third of the error of the one before.
    for _ in range(ROUNDS):
        u_b = rotation.rotate_back(R[left], air_n[left])
        new = drag(frame, u_b, push[left] / length, density[left])
        needed = force_n[left] - rotation.rotate(R[left], new)
        change = np.max(np.abs(new - drag_b[left]), axis=1)
        drag_b[left] = new
        push[left] = np.linalg.norm(needed, axis=1)
        R[left] = _along(-needed, yaw[left]) @ turn
        left = left[change > 1e-14 * push[left]]
        if not len(left):
            break
    return Balance(R, push / length, drag_b)


def outputs(
    frame: Airframe,
    balance: Balance,
    *,
    w_b: Array,
    air_n: Array,
    wind_n: Array,
    density: Array,
    mass: Array,
    lifting: Array,
    height: Array,
    armed: Array,
    indicated: Array,
) -> Outputs:
    """What motors and battery do at a balance.

    Args:
        frame: the vehicle.
        balance: of every sample.
        w_b: (n, 3) body rates, rad/s.
        air_n: (n, 3) velocity through the air, m/s.
        wind_n: (n, 3) m/s.
        density: (n,) kg/m^3.
        mass: (n,) kg.
        lifting: (n,) share of the weight that the motors carry: 0 standing, 1 flying.
        height: (n,) of the feet over the ground, m.
        armed: (n,) 1 where the motors spin, 0 where they do not.
        indicated: (n,) airspeed that the autopilot tells, m/s.
    """
    below = 1.0 - ground_gain(frame, height)
    total = balance.thrust * lifting * below
    force = motors.shared(frame, total, w_b, derivative(w_b))
    inflow = np.maximum(0.0, -rotation.rotate_back(balance.R_nb, air_n)[:, 2]) * lifting
    power = frame.power_factor * np.sum(force, axis=1) + AVIONICS_W
    battery = discharge(frame, power)
    command = motors.command(frame, force, density=density, inflow=inflow, voltage=battery.voltage)
    asked = command + frame.motor_lag * derivative(command)
    flying = motors.pulse(frame, np.clip(asked, 0.0, 1.0))
    idle = frame.pwmMin + SPIN_ARM * (frame.pwmMax - frame.pwmMin)
    standing = np.where(armed > 0.0, idle, frame.pwmMin)
    vector = np.array(frame.motor_vector)
    return Outputs(
        pwm=np.where(lifting[:, None] > 0.0, flying, standing[:, None]),
        voltage=battery.voltage,
        current=battery.current,
        consumed=1000.0 * battery.drawn,
        indicated=indicated,
        told_wind=np.zeros((len(mass), 2)),  # EKF3's drag coefficients are zero by default
        wind_n=wind_n,
        density=density,
        mass=mass,
        thrust_b=np.outer(balance.thrust * lifting, vector),
        drag_b=balance.drag_b,
    )


def ground_gain(frame: Airframe, height: Array) -> Array:
    """(n,) share of the thrust that the ground gives: Cheeseman and Bennett's ``(R / 4 h)^2``."""
    above = np.maximum(height, 0.0) + GAP + frame.rotor_radius
    out: Array = np.minimum((frame.ground_effect * frame.rotor_radius / (4.0 * above)) ** 2, 0.5)
    return out


def linear_drag(frame: Airframe, speed: float) -> float:
    """Drag over mass and speed at about this airspeed, 1/s."""
    return frame.mcoef + 0.5 * SEA_LEVEL_DENSITY * 2.0 * speed / frame.bcoef


def _along(down: Array, yaw: Array) -> Array:
    """Frames with z along ``down`` and x towards a heading."""
    z = down / np.linalg.norm(down, axis=1)[:, None]
    right = np.column_stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)])
    x = np.cross(right, z)
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _to_straight_up(vector: Array) -> Array:
    """(3, 3) shortest rotation that takes a direction of thrust to (0, 0, -1)."""
    unit = vector / np.linalg.norm(vector)
    axis = np.cross(unit, np.array([0.0, 0.0, -1.0]))
    size = float(np.linalg.norm(axis))
    if size < 1e-12:
        return np.eye(3)
    angle = float(np.arctan2(size, -unit[2]))
    return rotation.from_vector(axis / size * angle)
