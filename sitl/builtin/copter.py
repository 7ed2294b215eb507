"""Flights of a multicopter: velocity and heading steps; thrust and rotor drag make its forces.

A multicopter's thrust has only a body-z component, so that everything that an accelerometer
feels along x and y is drag: ``f = -T z_b - k P (v - wind)`` with ``P`` the projection on the
rotor plane (Martin and Salaun 2010).  The attitude follows in closed form from the
acceleration wanted: ``f + k (v - wind)`` lies along ``-z_b``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin import rotation, trajectory
from sitl.builtin.smoothing import (
    RATE,
    Array,
    band_limited_noise,
    derivative,
    integral,
    smooth,
    staircase,
)
from sitl.builtin.trajectory import Environment, Start, Trajectory

HORIZONTAL_S = (1.7, 0.9, 0.5, 0.2)
VERTICAL_S = (0.9, 0.6, 0.4, 0.2)
YAW_S = (1.2, 0.6, 0.4, 0.2)
SETTLING_S = sum(HORIZONTAL_S)
GUST_S = (0.5, 0.35, 0.25, 0.15, 0.1)
CLIMB = 2.5
DESCENT = 1.5
RANGE = 150.0
FLOOR, CEILING = 12.0, 70.0
HOVER_THROTTLE = 0.35
LONGEST_S = 20.0
"""A manoeuvre and coming down from where it may have climbed to."""
DULL_GUSTS = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class CopterFlight:
    """What to fly; ``duration`` includes the ground at both ends (s).

    From ``stop_at`` on no new manoeuvre begins and it comes down; what it flew until then
    does not change.
    """

    seed: int
    duration: float
    dull: bool = False
    drag: tuple[float, float] = (0.16, 0.20)
    drag_quadratic: float = 0.015
    gusts: float = 0.03
    stop_at: float | None = None


@dataclass(slots=True)
class _Plan:
    """Commands as they are given: times and values of velocity and yaw."""

    times: list[float]
    velocity: list[tuple[float, float, float]]
    yaw_times: list[float]
    yaw: list[float]
    lift_off: float
    touch_down: float


def copter_trajectory(flight: CopterFlight, environment: Environment, start: Start) -> Trajectory:
    """Flies it: arm, take off, manoeuvre (or hover, if dull), land, disarm."""
    plan = _plan(flight, start)
    n = trajectory.whole_samples(min(flight.duration, plan.touch_down + 5.0))
    steps = np.array(plan.velocity)
    v_n = np.column_stack(
        [
            smooth(staircase(n, plan.times, steps[:, i]), window)
            for i, window in enumerate((HORIZONTAL_S, HORIZONTAL_S, VERTICAL_S))
        ]
    )
    aloft = trajectory.envelope(n, plan.lift_off + 0.5, plan.touch_down - 0.5, 2.0)
    gusts = flight.gusts * (DULL_GUSTS if flight.dull else 1.0)
    for axis, share in enumerate((1.0, 1.0, 0.7)):
        rng = np.random.default_rng([flight.seed, 1, axis])
        shake = band_limited_noise(rng, n, gusts * share, GUST_S)
        v_n[:, axis] += derivative(aloft * shake)
    yaw = smooth(staircase(n, plan.yaw_times, plan.yaw), YAW_S)
    return _body(flight, environment, start, v_n=v_n, yaw=yaw, aloft=aloft, plan=plan)


def _body(
    flight: CopterFlight,
    environment: Environment,
    start: Start,
    *,
    v_n: Array,
    yaw: Array,
    aloft: Array,
    plan: _Plan,
) -> Trajectory:
    """Attitude and forces that belong to a velocity and a heading."""
    n = len(yaw)
    f_n = trajectory.specific_force_n(v_n, environment)
    air_n = v_n - np.outer(aloft, environment.wind_n)
    airspeed = np.linalg.norm(air_n, axis=1)
    mean = 0.5 * sum(flight.drag)
    unequal = np.array([flight.drag[0] - mean, flight.drag[1] - mean, 0.0])
    along = f_n + (mean + flight.drag_quadratic * airspeed)[:, None] * air_n
    right = np.column_stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)])
    R = _thrust_frame(-along, right)
    # Only the difference between drag along x and y has no closed form; each round leaves
    # a few per cent of what the one before left.
    for _ in range(3):
        remainder = unequal * rotation.rotate_back(R, air_n)
        R = _thrust_frame(-(along + rotation.rotate(R, remainder)), right)
    f_b = rotation.rotate_back(R, f_n)
    t = np.arange(n) / RATE
    thrust = np.clip(-f_b[:, 2] / trajectory.STANDARD_GRAVITY, 0.0, None)
    in_air = (t >= plan.lift_off) & (t < plan.touch_down)
    return Trajectory(
        R_nb=R,
        w_b=trajectory.body_rate(R, v_n, environment),
        v_n=v_n,
        p_n=integral(v_n) + np.array(start.position_n),
        f_b=f_b,
        throttle=np.clip(HOVER_THROTTLE * thrust, 0.0, 1.0) * in_air,
        airspeed=airspeed,
        armed=(t >= plan.lift_off - 2.0) & (t < plan.touch_down + 2.0),
        landed=~in_air,
        environment=environment,
    )


def _thrust_frame(down: Array, right: Array) -> Array:
    """Frame with z along ``down`` and the yaw (ZYX) of which ``right`` is to the right, level."""
    z = down / np.linalg.norm(down, axis=1)[:, None]
    x = rotation.crossed(right, z)
    x /= np.linalg.norm(x, axis=1)[:, None]
    R = np.empty((len(z), 3, 3))
    R[:, :, 0], R[:, :, 1], R[:, :, 2] = x, rotation.crossed(z, x), z
    return R


def _plan(flight: CopterFlight, start: Start) -> _Plan:
    """Random commands; integrals of commands are exact, so height and place are known here."""
    rng = np.random.default_rng([flight.seed, 0])
    lift_off = 5.0
    plan = _Plan([0.0, lift_off], [(0, 0, 0), (0, 0, -CLIMB)], [0.0], [start.yaw], lift_off, 0.0)
    t = lift_off + 10.0
    place = np.array([0.0, 0.0])
    height = CLIMB * 10.0
    plan.times.append(t)
    plan.velocity.append((0, 0, 0))
    t += SETTLING_S
    heading = start.yaw
    last = flight.duration
    stop = np.inf if flight.stop_at is None else flight.stop_at
    while t + LONGEST_S + _landing_time(height) < last and t < stop and not flight.dull:
        hold = rng.uniform(2.2, 5.0)
        course = rng.uniform(-np.pi, np.pi)
        if np.linalg.norm(place) > RANGE:
            course = float(np.arctan2(-place[1], -place[0])) + rng.uniform(-0.7, 0.7)
        speed = rng.uniform(4.0, 12.0) * (rng.random() > 0.12)
        climb = rng.uniform(-3.5, 3.5)
        if not FLOOR < height + climb * hold < CEILING:
            climb = -climb if FLOOR < height - climb * hold < CEILING else 0.0
        command = np.array([speed * np.cos(course), speed * np.sin(course)])
        plan.times.append(t)
        plan.velocity.append((float(command[0]), float(command[1]), -climb))
        place += command * hold
        height += climb * hold
        if rng.random() < 0.6:
            heading += rng.uniform(-2.2, 2.2)
            plan.yaw_times.append(t + rng.uniform(0.0, 0.5 * hold))
            plan.yaw.append(heading)
        t += hold
    if flight.dull:
        t = max(t, min(stop, last - _landing_time(height) - 1.0))
    descent = height / DESCENT
    plan.times += [t, t + SETTLING_S, t + SETTLING_S + descent]
    plan.velocity += [(0, 0, 0), (0, 0, DESCENT), (0, 0, 0)]
    plan.touch_down = t + SETTLING_S + descent + sum(VERTICAL_S)
    return plan


def _landing_time(height: float) -> float:
    """From the end of the last manoeuvre to the end of the recording, s."""
    return height / DESCENT + SETTLING_S + sum(VERTICAL_S) + 5.0
