"""The way up to a recorded flight that begins in the air, and down from one that ends there.

Who flies it again begins and ends on the ground.  Without a way of its own the height would be
taken off the flight instead: all of it would be flown lower than it was, and into the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from sitl.builtin.smoothing import Array

STANDING_S = 1.0
"""Time that a vehicle stands at an end of a recording that begins or ends on the ground."""
BRAKE_M_S2 = 2.0
"""What any multicopter can do in any wind that it flies in."""
SINK_M_S = 1.5
"""Slow enough for its own downwash."""
STEP_S = 0.1

Way: TypeAlias = Callable[[Array, float], Array]
"""Of what was flown until the end, (n, 4), and the height there, m: (k, 4) times after it and
velocities, to where it stands on the ground."""


def sinking(flown: Array, height: float) -> Array:
    """A multicopter's way."""
    return way_down(flown[-1, 1:], height)


def grounded(velocity: Array, heights: Array, flying_m_s: float, way: Way = sinking) -> Array:
    """(k, 4) times and velocities from the ground to the ground.

    Args:
        velocity: (n, 4) s and NED m/s, as recorded.
        heights: (m, 2) s and m above any one level; over home, where it never stands.
        flying_m_s: speed from which on it flies.
        way: by which it comes down.
    """
    if not len(heights):
        return velocity
    t = velocity[:, 0]
    flying = t[np.linalg.norm(velocity[:, 1:], axis=1) > flying_m_s]
    if not len(flying):
        return velocity
    first, last = np.interp(t[[0, -1]], heights[:, 0], heights[:, 1])
    stood, stands = flying[0] - t[0] > STANDING_S, t[-1] - flying[-1] > STANDING_S
    ground = first if stood else last if stands else 0.0
    parts = [velocity]
    if not stood:
        # The way up is a way down, backwards.
        down = way(-velocity[::-1], first - ground)
        back = np.column_stack([t[0] - down[:, 0], -down[:, 1:]])
        parts.insert(0, back[::-1])
    if not stands:
        down = way(velocity, last - ground)
        parts.append(np.column_stack([t[-1] + down[:, 0], down[:, 1:]]))
    return np.concatenate(parts)


def way_down(v_n: Array, height: float) -> Array:
    """(k, 4) times after it begins, and velocities, to where it stands on the ground.

    Args:
        v_n: (3,) velocity that it begins with, NED, m/s.
        height: above the ground, m.
    """
    over = float(np.linalg.norm(v_n[:2]))
    longest = (over + abs(float(v_n[2])) + SINK_M_S) / BRAKE_M_S2
    # What it climbs until it sinks has to be sunk, too.
    longest += (max(height, 0.0) + 0.5 * float(v_n[2]) ** 2 / BRAKE_M_S2) / SINK_M_S
    t = STEP_S * np.arange(1.0, longest / STEP_S + 2.0)
    share = np.maximum(1.0 - BRAKE_M_S2 * t / max(over, 1e-9), 0.0)
    change = np.clip(SINK_M_S - v_n[2], -BRAKE_M_S2 * t, BRAKE_M_S2 * t)
    down = v_n[2] + change
    below = height - STEP_S * np.cumsum(down)
    down[(below < 0.0) & (t > abs(SINK_M_S - v_n[2]) / BRAKE_M_S2)] = 0.0
    return np.column_stack([t, share * v_n[0], share * v_n[1], down])
