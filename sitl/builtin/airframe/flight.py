"""A flight with an airframe: a motion that is commanded, the air, and the forces that make it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from sitl.builtin.airframe import copter_force, wing_force
from sitl.builtin.airframe.air import SEA_LEVEL_DENSITY, Air, convolved, density
from sitl.builtin.airframe.battery import rest_voltage
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.motion import Motion
from sitl.builtin.airframe.motors import command_of_pulse, curve
from sitl.builtin.airframe.outputs import Outputs
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.smoothing import DT, RATE, Array, derivative, integral, moving_average
from sitl.builtin.trajectory import (
    Environment,
    Trajectory,
    body_rate,
    envelope,
    specific_force_n,
)

Craft: TypeAlias = Airframe | Wing
HOLDING = 1.0
"""How fast the autopilot brings back what a gust has carried away, rad/s."""
MEMORY_S = 12.0
SPIN_UP_S = 1.0
CRUISE = 20.0
CONFIGURED_EXPO = 0.65
"""MOT_THST_EXPO of the autopilot, whatever its propellers are like."""
CONFIGURED_RATIO = 2.0
"""ARSPD_RATIO of the autopilot."""
PITOT_NOISE = 0.15
WIND_LATE_S, WIND_WRONG = 20.0, 0.4


@dataclass(frozen=True, slots=True)
class _Course:
    """What an airframe has to follow: n samples.

    Attributes:
        v_n: (n, 3) velocity, m/s NED.
        f_n: (n, 3) specific force that makes it, m/s^2 NED.
        wind_n: (n, 3) velocity of the air, m/s NED.
        unlooked_n: (n, 3) what of it the autopilot does not turn the nose into: gusts, and how
            far they have carried it from its way, m/s NED.
        rho: (n,) density, kg/m^3.
        aloft: (n,) 0 on the ground to 1 in the air.
    """

    v_n: Array
    f_n: Array
    wind_n: Array
    unlooked_n: Array
    rho: Array
    aloft: Array


def flown(motion: Motion, craft: Craft, air: Air, environment: Environment) -> Trajectory:
    """The trajectory of a commanded motion in moving air.

    Gusts carry the vehicle away and the autopilot brings it back; attitude and thrust are those at
    which all forces balance, at every millisecond.
    """
    n = motion.n
    begin, end = motion.in_air_s
    copter = isinstance(craft, Airframe)
    aloft = envelope(n, begin + 0.5, end - 0.5, 2.0) if copter else motion.aloft
    unsteady = aloft[:, None] * air.unsteady(n)
    away = integral(_carried(craft, unsteady, motion.yaw))
    # It touches down where it was told to.
    away *= envelope(n, begin + 1.0, end - 1.0, 4.0)[:, None]
    v_n = motion.v_n + derivative(away)
    p_n = integral(v_n) + np.array(motion.start.position_n)
    t = np.arange(n, dtype=np.float64) * DT
    wind_n = aloft[:, None] * air.steady(-p_n[:, 2], t) + unsteady
    rho = air.density_ratio * density(environment.altitude - p_n[:, 2])
    f_n = specific_force_n(v_n, environment)
    course = _Course(v_n, f_n, wind_n, unsteady - derivative(away), rho, aloft)
    if isinstance(craft, Airframe):
        R, throttle, outputs = _copter(craft, motion, environment, course)
    else:
        R, throttle, outputs = _plane(craft, motion, air, environment, course)
    return Trajectory(
        R_nb=R,
        w_b=body_rate(R, v_n, environment),
        v_n=v_n,
        p_n=p_n,
        f_b=np.einsum("nji,nj->ni", R, f_n),
        throttle=throttle,
        airspeed=np.linalg.norm(v_n - wind_n, axis=1),
        armed=motion.armed,
        landed=motion.landed,
        environment=environment,
        outputs=outputs,
    )


def idle(craft: Craft, n: int, altitude: float, consumed: float) -> Outputs:
    """Outputs of a vehicle that stands disarmed after it has used so many mAh."""
    zero = np.zeros((n, 3))
    if isinstance(craft, Airframe):
        pwm = np.full((n, craft.num_motors), craft.pwmMin)
        drawn = np.array([consumed / 1000.0])
        voltage = float(rest_voltage(craft, drawn)[0])
    else:
        pwm = np.tile([1500.0, 1500.0, 1000.0, 1500.0], (n, 1))
        voltage = wing_force.VOLTAGE
    return Outputs(
        pwm=pwm,
        voltage=np.full(n, voltage),
        current=np.full(n, 0.4),
        consumed=np.full(n, consumed),
        indicated=np.zeros(n),
        told_wind=np.zeros((n, 2)),
        wind_n=zero,
        density=np.full(n, float(density(np.array(altitude)))),
        mass=np.full(n, craft.mass),
        thrust_b=zero,
        drag_b=zero,
    )


def _copter(
    frame: Airframe,
    motion: Motion,
    environment: Environment,
    course: _Course,
) -> tuple[Array, Array, Outputs]:
    v_n, wind_n, rho = course.v_n, course.wind_n, course.rho
    t = np.arange(motion.n, dtype=np.float64) * DT
    begin, end = motion.in_air_s
    mass = frame.mass_over(t)
    air_n = v_n - wind_n
    balance = copter_force.balanced(frame, course.f_n, air_n, motion.yaw, mass=mass, density=rho)
    lifting = envelope(motion.n, begin - SPIN_UP_S, end + SPIN_UP_S, SPIN_UP_S)
    outputs = copter_force.outputs(
        frame,
        balance,
        w_b=body_rate(balance.R_nb, v_n, environment),
        air_n=air_n,
        wind_n=wind_n,
        density=rho,
        mass=mass,
        lifting=lifting,
        height=integral(-v_n[:, 2]),
        armed=motion.armed.astype(np.float64),
        # Without a sensor and without wind in its filter, an autopilot says this.
        indicated=np.linalg.norm(v_n, axis=1) * np.sqrt(rho / SEA_LEVEL_DENSITY),
    )
    command = command_of_pulse(frame, outputs.pwm)
    return balance.R_nb, np.mean(curve(command, CONFIGURED_EXPO), axis=1), outputs


def _plane(
    wing: Wing,
    motion: Motion,
    air: Air,
    environment: Environment,
    course: _Course,
) -> tuple[Array, Array, Outputs]:
    v_n, wind_n, rho = course.v_n, course.wind_n, course.rho
    t = np.arange(motion.n, dtype=np.float64) * DT
    mass = wing.mass_over(t)
    air_n = v_n - wind_n
    balance = wing_force.balanced(
        wing,
        course.f_n,
        air_n,
        bank=motion.bank,
        slip=motion.slip,
        course=_course(air_n, motion.start.yaw),
        steered=_course(air_n + course.unlooked_n, motion.start.yaw),
        aloft=course.aloft,
        mass=mass,
        density=rho,
    )
    moving = np.linalg.norm(v_n, axis=1) > 0.05
    rng = np.random.default_rng([air.seed, 72])
    outputs = wing_force.outputs(
        wing,
        balance,
        w_b=body_rate(balance.R_nb, v_n, environment),
        air_n=air_n,
        wind_n=wind_n,
        density=rho,
        mass=mass,
        powered=(motion.armed & moving).astype(np.float64),
        indicated_error=PITOT_NOISE * rng.standard_normal(motion.n),
        told_wind=_believed(wind_n, air.seed),
        configured_ratio=CONFIGURED_RATIO,
    )
    return balance.R_nb, (outputs.pwm[:, 2] - 1000.0) / 1000.0, outputs


def _believed(wind_n: Array, seed: int) -> Array:
    """(n, 2) wind as a plane's filter has it: late, and a little wrong."""
    rng = np.random.default_rng([seed, 73])
    wrong = WIND_WRONG * rng.standard_normal(2)
    out: Array = moving_average(wind_n[:, :2], WIND_LATE_S) + wrong
    return out


def _course(air_n: Array, at_rest: float) -> Array:
    """(n,) direction of the air velocity over ground, held where it is slow, rad."""
    fast = np.flatnonzero(np.hypot(air_n[:, 0], air_n[:, 1]) > 3.0)
    if not len(fast):
        return np.full(len(air_n), at_rest)
    course = np.unwrap(np.arctan2(air_n[fast, 1], air_n[fast, 0]))
    out: Array = np.interp(np.arange(len(air_n)), fast, course)
    return out


def _carried(craft: Craft, gust_n: Array, course: Array) -> Array:
    """(n, 3) velocity that gusts give: ``v' = k (w - v) - 2 h v - h^2 x`` in each axis.

    k is what the air holds on to: drag, side force along and across the course, lift upwards.
    """
    if not gust_n.any():
        return np.zeros_like(gust_n)
    if isinstance(craft, Airframe):
        gain = copter_force.linear_drag(craft, 6.0)
        return np.column_stack([_held(gain, gust_n[:, i]) for i in range(3)])
    pressure = 0.5 * SEA_LEVEL_DENSITY * CRUISE * craft.s / craft.mass
    drag, side = 2.0 * pressure * craft.c_drag_p, -pressure * craft.c_y_b
    ahead = np.column_stack([np.cos(course), np.sin(course)])
    right = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    out = np.empty_like(gust_n)
    out[:, :2] = 0.0
    for way, gain in ((ahead, drag), (right, side)):
        out[:, :2] += way * _held(gain, np.sum(way * gust_n[:, :2], axis=1))[:, None]
    out[:, 2] = _held(pressure * craft.c_lift_a, gust_n[:, 2])
    return out


def _held(gain: float, gust: Array) -> Array:
    """(n,) velocity along one axis, m/s; ``gain`` in 1/s."""
    t = np.arange(round(MEMORY_S * RATE), dtype=np.float64) * DT
    half = 0.5 * gain + HOLDING
    root = np.sqrt(half**2 - HOLDING**2)
    fast, slow = half + root, half - root
    response = gain * (fast * np.exp(-fast * t) - slow * np.exp(-slow * t)) / (fast - slow)
    return convolved(gust, DT * response)
