"""A multicopter's mission that shows its airframe: hovers, fast legs, climbs, circles, turns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sitl.builtin.airframe.motion import Motion
from sitl.builtin.smoothing import RATE, band_limited_noise, derivative, smooth, staircase
from sitl.builtin.trajectory import Start, envelope, whole_samples

Rng = np.random.Generator
HORIZONTAL_S = (2.4, 1.3, 0.5, 0.2)
VERTICAL_S = (1.0, 0.6, 0.4, 0.2)
YAW_S = (3.0, 1.5, 0.6, 0.3)
SHAKE_S = (0.5, 0.35, 0.25, 0.15, 0.1)
SHAKE = 0.03
SETTLING_S = sum(HORIZONTAL_S)
CLIMB, DESCENT = 2.5, 2.0
LIFT_OFF = 5.0
FLOOR, CEILING = 8.0, 75.0
RANGE = 160.0
LONGEST_S = 20.0


@dataclass(slots=True)
class _Plan:
    """Commands as they are given."""

    t: float
    height: float
    heading: float
    place: tuple[float, float] = (0.0, 0.0)
    times: list[float] = field(default_factory=list)
    velocity: list[tuple[float, float, float]] = field(default_factory=list)
    yaw_times: list[float] = field(default_factory=list)
    yaw: list[float] = field(default_factory=list)

    def go(self, seconds: float, north: float = 0.0, east: float = 0.0, climb: float = 0.0) -> None:
        """A velocity for so long."""
        self.times.append(self.t)
        self.velocity.append((north, east, -climb))
        self.place = (self.place[0] + north * seconds, self.place[1] + east * seconds)
        self.height += climb * seconds
        self.t += seconds

    def turn(self, heading: float, at: float) -> None:
        """Another heading from a time on."""
        self.heading = heading
        self.yaw_times.append(at)
        self.yaw.append(heading)


def mission(
    seed: int,
    duration: float,
    start: Start,
    *,
    fastest: float = 11.0,
    stop_at: float | None = None,
    dull: bool = False,
) -> Motion:
    """A flight from ground to ground within ``duration`` (s), by chance of the seed.

    Args:
        seed: of what is flown.
        duration: with the ground at both ends.
        start: where it stands.
        fastest: speed over ground of the fastest legs, m/s.
        stop_at: from then on it comes down.
        dull: nothing but a hover.
    """
    rng = np.random.default_rng([seed, 3])
    plan = _Plan(LIFT_OFF, 0.0, start.yaw, times=[0.0], velocity=[(0.0, 0.0, 0.0)])
    plan.turn(start.yaw, 0.0)
    plan.go(float(rng.uniform(6.0, 20.0)), climb=CLIMB)
    plan.go(SETTLING_S)
    stop = np.inf if stop_at is None else stop_at
    if dull:
        plan.go(max(0.0, min(duration - _landing(plan.height), stop) - plan.t))
    kinds = ["hover", "fast", "climb", "circle", "fast", "turn"]
    while plan.t < stop and plan.t + LONGEST_S + _landing(plan.height) < duration and not dull:
        if not kinds:
            kinds = ["hover", "fast", "climb", "circle", "fast", "turn"]
        _leg(plan, kinds.pop(int(rng.integers(len(kinds)))), rng, fastest)
    plan.go(SETTLING_S)
    plan.go(plan.height / DESCENT, climb=-DESCENT)
    plan.go(0.0)
    touch_down = plan.t + sum(VERTICAL_S)
    return _flown(plan, seed, min(duration, touch_down + 5.0), touch_down, start)


def _leg(plan: _Plan, kind: str, rng: Rng, fastest: float) -> None:
    """One part of the mission; sizes by chance."""
    course = float(rng.uniform(-np.pi, np.pi))
    if np.hypot(*plan.place) > 0.5 * RANGE:
        home = float(np.arctan2(-plan.place[1], -plan.place[0]))
        course = home + float(rng.uniform(-0.6, 0.6))
    climb = float(rng.uniform(1.5, 3.0)) * (1.0 if rng.random() < 0.5 else -1.0)
    seconds = float(rng.uniform(4.0, 7.0))
    if not FLOOR < plan.height + climb * seconds < CEILING:
        climb = -climb if FLOOR < plan.height - climb * seconds < CEILING else 0.0
    speed = float(rng.uniform(0.6, 1.0)) * fastest
    if rng.random() < 0.6:
        plan.turn(plan.heading + float(rng.uniform(-2.5, 2.5)), plan.t + float(rng.uniform(0, 2)))
    match kind:
        case "hover":
            plan.go(seconds)
        case "fast":
            plan.go(seconds + 2.0, speed * np.cos(course), speed * np.sin(course))
            if rng.random() < 0.5:  # and back
                plan.go(2.5)
                plan.go(seconds, -speed * np.cos(course), -speed * np.sin(course))
        case "climb":
            drift = 0.3 * speed * float(rng.random() < 0.5)
            plan.go(seconds, drift * np.cos(course), drift * np.sin(course), climb)
        case "circle":
            side = 1.0 if rng.random() < 0.5 else -1.0
            for i in range(8):
                angle = course + side * i * np.pi / 4.0
                plan.go(1.5, 0.8 * speed * np.cos(angle), 0.8 * speed * np.sin(angle))
        case _:
            plan.turn(plan.heading + float(rng.uniform(1.5, 3.0)), plan.t)
            plan.go(3.0, 0.3 * speed * np.cos(course), 0.3 * speed * np.sin(course), 0.5 * climb)


def _flown(plan: _Plan, seed: int, duration: float, touch_down: float, start: Start) -> Motion:
    n = whole_samples(duration)
    steps = np.array(plan.velocity)
    windows = (HORIZONTAL_S, HORIZONTAL_S, VERTICAL_S)
    v_n = np.column_stack(
        [smooth(staircase(n, plan.times, steps[:, i]), w) for i, w in enumerate(windows)]
    )
    aloft = envelope(n, LIFT_OFF + 0.5, touch_down - 0.5, 2.0)
    for axis, share in enumerate((1.0, 1.0, 0.7)):
        rng = np.random.default_rng([seed, 4, axis])
        v_n[:, axis] += derivative(aloft * band_limited_noise(rng, n, SHAKE * share, SHAKE_S))
    t = np.arange(n) / RATE
    return Motion(
        v_n=v_n,
        yaw=smooth(staircase(n, plan.yaw_times, plan.yaw), YAW_S),
        bank=np.zeros(n),
        slip=np.zeros(n),
        armed=(t >= LIFT_OFF - 2.0) & (t < touch_down + 2.0),
        landed=(t < LIFT_OFF) | (t >= touch_down),
        start=start,
    )


def _landing(height: float) -> float:
    """From the last leg to the end of the recording, s."""
    return SETTLING_S + height / DESCENT + sum(VERTICAL_S) + 5.0
