"""Whether a recording's force, attitude and velocity are of one flight."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.contradiction import Contradiction, contradiction


def wander(seed, seconds=60.0, rate=5.0, size=0.9):
    """Velocity that an accelerometer misses by ``size`` m/s^2, any way, and a receiver's noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    way = rng.normal(size=3)
    off = size * t[:, None] * way / np.linalg.norm(way)
    return t, off + rng.normal(scale=0.1, size=(len(t), 3))


@pytest.mark.parametrize("seed", range(10))
def test_an_accelerometer_that_nobody_calibrated_is_no_contradiction(seed):
    found = contradiction([wander(seed), wander(seed + 100)])
    assert found.seconds == 0.0
    assert found.of_s == pytest.approx(118.0, abs=2.0)
    assert str(found) == ""


def test_a_velocity_that_jumps_is_said_and_one_jump_is_not_hopeless():
    t, off = wander(1)
    off[t > 30.4] += (0.0, 12.0, 0.0)
    found = contradiction([(t, off)])
    assert 1.0 <= found.seconds <= 2.0
    assert found.worst == pytest.approx(12.0, abs=1.5)
    assert not found.hopeless
    assert "by up to 1" in str(found)


def test_an_attitude_that_is_half_a_right_angle_off_leaves_nothing_to_say():
    """It turns gravity into 7.5 m/s^2 that no velocity shows."""
    t, off = wander(2)
    tilted = 9.81 * np.array([np.sin(np.pi / 4), 0.0, np.cos(np.pi / 4) - 1.0])
    found = contradiction([(t, off + t[:, None] * tilted)])
    assert found.hopeless
    assert found.seconds == found.of_s


def test_velocities_that_are_not_believed_say_nothing():
    t, off = wander(3)
    off[t > 30.0] += 50.0
    off[(t > 20.0) & (t < 40.0)] = np.nan
    assert contradiction([(t, off)]).seconds == 0.0
    assert contradiction([(t, np.full_like(off, np.nan))]) == Contradiction()
    assert contradiction([]) == Contradiction()


def test_a_vertical_speed_that_lags_in_a_climb_contradicts_nothing():
    t, off = wander(4)
    off[:, 2] += 10.0 * np.sin(t)
    assert contradiction([(t, off)]).seconds == 0.0
