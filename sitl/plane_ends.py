"""The way down of a plane from a recorded flight that ends in the air; backwards, the way up.

It rolls out of its turn, goes straight on and sinks as a plane lands: slower as the ground comes
near, and on its wheels after that.  What it flies with is the velocity over ground that it had, so
the air carries it as before.
"""

from __future__ import annotations

import math

import numpy as np

from sitl.builtin.smoothing import Array

STEP_S = 0.05
SINK_M_S = 3.0
"""A path of 11 degrees at 16 m/s, up or down."""
PULL_M_S2 = 1.5
"""What that begins with: a sixth of the weight more or less to carry."""
FLARE_M_S2 = 0.5
"""Sinks so fast that this stops it at the ground."""
TOUCH_M_S = 0.3
"""It meets the ground with."""
ROLL_OUT_S = 3.0
"""A turn ends in."""
TURNING_S = 1.0
"""Last part of the flight, from which the turn is known."""
LEAST_M_S = 16.0
"""Over ground: slower against the wind, a plane would be taken for one that stands."""
GAIN_M_S2 = 0.5
BRAKE_M_S2 = 3.0
"""Of wheels; and what takes it off."""


def landing(flown: Array, height: float) -> Array:
    """(k, 4) times after the end, and velocities, to where it stands on the ground.

    Args:
        flown: (n, 4) s and NED m/s until the end, in order.
        height: there, above the ground, m.
    """
    last = flown[-1]
    course, turning = _turn(flown)
    speed, down, t = float(np.hypot(last[1], last[2])), float(last[3]), 0.0
    rows: list[tuple[float, float, float, float]] = []
    while speed > 0.0:
        t += STEP_S
        course += STEP_S * turning * max(1.0 - t / ROLL_OUT_S, 0.0)
        if height > 0.0:
            speed = max(speed, min(speed + GAIN_M_S2 * STEP_S, LEAST_M_S))
            wanted = min(SINK_M_S, math.sqrt(TOUCH_M_S**2 + 2.0 * FLARE_M_S2 * height))
            most = PULL_M_S2 * STEP_S
            down += min(max(wanted - down, -most), most)
            height -= down * STEP_S
        else:
            speed = max(speed - BRAKE_M_S2 * STEP_S, 0.0)
            down = 0.0
        rows.append((t, speed * math.cos(course), speed * math.sin(course), down))
    return np.array(rows)


def _turn(flown: Array) -> tuple[float, float]:
    """Course at the end, rad, and how fast it turns, rad/s."""
    t = flown[:, 0]
    late = flown[t > t[-1] - TURNING_S]
    course = np.unwrap(np.arctan2(late[:, 2], late[:, 1]))
    if len(late) < 3:
        return float(course[-1]), 0.0
    return float(course[-1]), float(np.polyfit(late[:, 0], course, 1)[0])
