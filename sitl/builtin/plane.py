"""Flights of a fixed-wing aircraft: bank, climb, speed and sideslip steps; lift makes its turns.

In wind axes (x along the air velocity, bank ``mu`` about it) with lift N, side force Y, per
unit mass: ``V dgamma/dt = N cos mu - Y sin mu - g cos gamma`` gives the lift that a climb
asks for, and ``V cos gamma dchi/dt = N sin mu + Y cos mu`` the turn that follows
(Stevens, Lewis and Johnson 2016, ch. 2).  Angle of attack follows from lift, Y from sideslip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin import rotation, trajectory
from sitl.builtin.smoothing import (
    DT,
    Array,
    band_limited_noise,
    derivative,
    integral,
    smooth,
    staircase,
)
from sitl.builtin.trajectory import Environment, Start, Trajectory

BANK_S = (0.7, 0.6, 0.4, 0.2)
CLIMB_S = (0.8, 0.6, 0.4, 0.2)
SPEED_S = (3.0, 1.5, 0.8, 0.4)
SLIP_S = (0.7, 0.5, 0.4, 0.2)
GUST_S = (0.45, 0.35, 0.25, 0.15, 0.1)
CRUISE = 20.0
ROTATION = 17.0
"""Speed of take-off, m/s."""
CLIMB_OUT = 4.0
SINK = 3.5
FLOOR, CEILING = 45.0, 110.0
RANGE = 700.0
SIDE_FORCE = 0.045
"""Side force per rad of sideslip and (m/s)^2 of dynamic speed, 1/m."""
ZERO_LIFT, LIFT_SLOPE = -0.02, 0.07
"""Angle of attack without lift, and what 1 g of lift adds at cruise speed, rad."""
MAX_THRUST = 6.5
LONGEST_S = 15.0
"""A manoeuvre and coming down from where it may have climbed to."""
DULL_GUSTS = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneFlight:
    """What to fly; ``duration`` includes the ground at both ends (s).

    From ``stop_at`` on no new manoeuvre begins and it comes down; what it flew until then
    does not change.
    """

    seed: int
    duration: float
    dull: bool = False
    max_bank: float = float(np.radians(50.0))
    gusts: float = 0.05
    stop_at: float | None = None


@dataclass(slots=True)
class _Plan:
    """Commands as they are given, columns bank, climb rate, airspeed, sideslip."""

    times: list[float]
    commands: list[tuple[float, float, float, float]]
    lift_off: float
    touch_down: float


def plane_trajectory(flight: PlaneFlight, environment: Environment, start: Start) -> Trajectory:
    """Flies it: arm, roll, take off, manoeuvre (or cruise straight, if dull), land, disarm."""
    plan = _plan(flight)
    n = trajectory.whole_samples(min(flight.duration, plan.touch_down + 15.0))
    steps = np.array(plan.commands)
    aloft = trajectory.envelope(n, plan.lift_off + 1.0, plan.touch_down - 1.0, 3.0)
    gusts = flight.gusts * (DULL_GUSTS if flight.dull else 1.0)

    def gust(sigma: float, signal: int) -> Array:
        rng = np.random.default_rng([flight.seed, 1, signal])
        return aloft * band_limited_noise(rng, n, sigma, GUST_S)

    bank = smooth(staircase(n, plan.times, steps[:, 0]), BANK_S) + gust(0.2 * gusts, 0)
    climb = smooth(staircase(n, plan.times, steps[:, 1]), CLIMB_S)
    climb += derivative(gust(gusts, 1))
    speed = smooth(staircase(n, plan.times, steps[:, 2]), SPEED_S)
    speed += gust(1.5 * gusts, 2)
    slip = smooth(staircase(n, plan.times, steps[:, 3]), SLIP_S) + gust(0.15 * gusts, 3)
    return _body(
        environment,
        start,
        bank=bank,
        climb=climb,
        speed=speed,
        slip=slip,
        aloft=aloft,
        plan=plan,
    )


def _body(
    environment: Environment,
    start: Start,
    *,
    bank: Array,
    climb: Array,
    speed: Array,
    slip: Array,
    aloft: Array,
    plan: _Plan,
) -> Trajectory:
    """Attitude and forces that belong to bank, climb rate, airspeed and sideslip."""
    n = len(bank)
    g = trajectory.STANDARD_GRAVITY
    V = np.maximum(speed, 4.0)
    gamma = np.arcsin(np.clip(climb / V, -0.7, 0.7))
    side = -SIDE_FORCE * slip * V**2
    lift = (V * derivative(gamma) + g * np.cos(gamma) + side * np.sin(bank)) / np.cos(bank)
    turn = aloft * (lift * np.sin(bank) + side * np.cos(bank)) / (V * np.cos(gamma))
    course = start.yaw + integral(turn)
    loading = lift / g * (CRUISE / np.maximum(V, 11.0)) ** 2
    attack = 0.03 + aloft * (ZERO_LIFT + LIFT_SLOPE * loading - 0.03)
    horizontal = np.sqrt(np.maximum(speed**2 - climb**2, 0.0))
    v_n = np.column_stack([horizontal * np.cos(course), horizontal * np.sin(course), -climb])
    v_n += np.outer(aloft, environment.wind_n)
    wind_axes = rotation.about_z(course) @ rotation.about_y(gamma) @ rotation.about_x(bank)
    R = wind_axes @ rotation.about_y(attack) @ rotation.about_z(-slip)
    drag = 1.1 * (V / CRUISE) ** 2 + 0.5 * lift**2 / g**2 * (CRUISE / np.maximum(V, 8.0)) ** 2
    thrust = derivative(speed) + g * np.sin(gamma) + drag
    t = np.arange(n) * DT
    in_air = (t >= plan.lift_off) & (t < plan.touch_down)
    armed = (t >= 2.0) & (t < plan.touch_down + 13.0)
    return Trajectory(
        R_nb=R,
        w_b=trajectory.body_rate(R, v_n, environment),
        v_n=v_n,
        p_n=integral(v_n) + np.array(start.position_n),
        f_b=rotation.rotate_back(R, trajectory.specific_force_n(v_n, environment)),
        throttle=np.clip(thrust / MAX_THRUST, 0.0, 1.0) * (armed & (speed > 0.05)),
        airspeed=speed,
        armed=armed,
        landed=~in_air,
        environment=environment,
    )


def _plan(flight: PlaneFlight) -> _Plan:
    """Random commands; integrals of climb commands are exact, so the height is known here."""
    rng = np.random.default_rng([flight.seed, 0])
    roll = 4.0
    lift_off = roll + sum(SPEED_S) * 0.75
    climb_out = FLOOR / CLIMB_OUT + 4.0
    plan = _Plan([0.0, roll], [(0, 0, 0, 0), (0, 0, CRUISE, 0)], lift_off, 0.0)
    t = lift_off + 2.0
    plan.times += [t, t + climb_out]
    plan.commands += [(0, CLIMB_OUT, CRUISE, 0), (0, 0, CRUISE, 0)]
    height = CLIMB_OUT * climb_out
    t += climb_out + 2.0
    side = 1.0 if rng.random() < 0.5 else -1.0
    last = flight.duration
    stop = np.inf if flight.stop_at is None else flight.stop_at
    while not flight.dull and t < stop and t + LONGEST_S + _landing_time(height) < last:
        for hold, command in _manoeuvre(rng, flight.max_bank, side):
            climb = command[1]
            if not FLOOR < height + climb * hold < CEILING:
                climb = -climb if FLOOR < height - climb * hold < CEILING else 0.0
            plan.times.append(t)
            plan.commands.append((command[0], climb, command[2], command[3]))
            height += climb * hold
            t += hold
        side = -side
    if flight.dull:
        t = max(t, min(stop, last - _landing_time(height) - 1.0))
    descent = (height - 4.0) / SINK
    flare = 4.0 / 1.0
    marks = [t, t + 3.0, t + 3.0 + descent, t + 3.0 + descent + flare]
    plan.times += [*marks, marks[-1] + 2.0]
    plan.commands += [
        (0, 0, CRUISE, 0),
        (0, SINK * -1.0, CRUISE, 0),
        (0, -1.0, CRUISE, 0),
        (0, 0, CRUISE, 0),
        (0, 0, 0, 0),
    ]
    plan.touch_down = marks[-1] + 2.0
    return plan


def _manoeuvre(
    rng: np.random.Generator, max_bank: float, side: float
) -> list[tuple[float, tuple[float, float, float, float]]]:
    """One manoeuvre: (seconds, (bank, climb rate, airspeed, sideslip)) a step."""
    speed = rng.uniform(15.0, 25.0)
    kind = rng.random()
    if kind < 0.45:  # a turn, climbing or sinking, perhaps slipping
        bank = side * rng.uniform(0.35, 1.0) * max_bank
        slip = rng.uniform(-0.12, 0.12) if rng.random() < 0.6 else 0.0
        return [(rng.uniform(4.0, 8.0), (bank, rng.uniform(-2.5, 2.5), speed, slip))]
    if kind < 0.65:  # pull up and push over
        climb = rng.uniform(2.5, 5.0) * (1.0 if rng.random() < 0.5 else -1.0)
        return [
            (rng.uniform(1.5, 2.2), (0.0, climb, speed, 0.0)),
            (rng.uniform(1.5, 2.2), (0.0, -climb, speed, 0.0)),
            (1.5, (0.0, 0.0, speed, 0.0)),
        ]
    if kind < 0.8:  # roll from side to side
        bank = side * rng.uniform(0.5, 0.9) * max_bank
        return [
            (rng.uniform(1.8, 3.0), (bank, 0.0, speed, 0.0)),
            (rng.uniform(1.8, 3.0), (-bank, 0.0, speed, 0.0)),
        ]
    slip = side * rng.uniform(0.08, 0.18)  # steady sideslips, speed change
    return [
        (rng.uniform(2.5, 4.0), (-0.4 * slip, 0.0, speed, slip)),
        (rng.uniform(2.5, 4.0), (0.4 * slip, 0.0, speed, -slip)),
    ]


def _landing_time(height: float) -> float:
    """From the end of the last manoeuvre to the end of the recording, s."""
    return 3.0 + (height - 4.0) / SINK + 4.0 + 2.0 + 15.0
