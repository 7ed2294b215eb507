"""What of a recorded motion an autopilot is told to fly again."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sitl.builtin.airframe.motion import Motion
from sitl.builtin.smoothing import DT
from sitl.builtin.trajectory import Start
from sitl.course import Course
from sitl.errors import SitlError
from sitl.manoeuvres import Manoeuvres


def motion(seconds=60.0, top=30.0, climb_s=10.0):
    """Up, a circle, down."""
    n = round(seconds / DT)
    t = DT * np.arange(n)
    v_n = np.zeros((n, 3))
    up, down = t < climb_s, t >= seconds - climb_s
    v_n[up, 2], v_n[down, 2] = -top / climb_s, top / climb_s
    v_n[:, 0], v_n[:, 1] = 3.0 * np.cos(0.5 * t), 3.0 * np.sin(0.5 * t)
    zero, aloft = np.zeros(n), np.zeros(n, dtype=bool)
    return Motion(v_n, 0.2 * t, zero, zero, ~aloft, aloft, Start())


def test_a_course_is_one_motion_in_place_velocity_and_acceleration():
    course = Course.of(motion())
    for seconds in (5.0, 17.0, 30.0):
        now, soon = course.at(seconds), course.at(seconds + 0.1)
        moved = np.subtract(soon.position, now.position)
        assert moved == pytest.approx(0.05 * np.add(now.velocity, soon.velocity), abs=0.01)
        gained = np.subtract(soon.velocity, now.velocity)[:2]
        assert gained == pytest.approx(0.1 * np.array(now.acceleration[:2]), abs=0.01)
        assert soon.yaw - now.yaw == pytest.approx(0.1 * now.yaw_rate)


def test_it_begins_and_ends_above_the_ground_over_the_place_of_take_off():
    course = Course.of(motion())
    assert course.start.position == pytest.approx((0.0, 0.0, -10.0), abs=0.01)
    assert course.start.velocity == (0.0, 0.0, 0.0)
    assert course.at(1e4).position[2] == pytest.approx(-10.0, abs=0.01)
    assert course.seconds == pytest.approx(60.0 - 2.0 * 10.0 / 3.0, abs=0.01)


def test_a_low_flight_is_followed_from_half_its_height():
    assert Course.of(motion(top=6.0)).start.position[2] == pytest.approx(-3.0, abs=0.01)


def test_what_hardly_leaves_the_ground_cannot_be_followed():
    with pytest.raises(SitlError, match="less than"):
        Course.of(motion(seconds=22.0))


async def test_a_copter_is_told_where_the_course_is_now_by_its_own_clock():
    class Vehicle:
        time, yaw, height = 100.0, 0.0, 10.0

        async def wait(self, seconds):
            self.time += 1.5 * seconds  # a slow machine: later than was asked

    class Radio:
        def __init__(self):
            self.told = []

        async def send_message(self, message):
            self.told.append((vehicle.time, json.loads(message.fields_json)))

    vehicle, radio, course = Vehicle(), Radio(), Course.of(motion())
    begun, ended = await Manoeuvres(vehicle, radio, seed=1).follow(course)
    assert ended - begun == pytest.approx(course.seconds)
    assert vehicle.time >= ended
    along = [(t, m) for t, m in radio.told if t >= begun]
    assert len(along) > 400
    for t, m in along:
        now = course.at(t - begun)
        assert (m["x"], m["y"], m["z"]) == now.position
        assert (m["vx"], m["vy"], m["vz"]) == now.velocity
        assert (m["afx"], m["afy"], m["afz"]) == now.acceleration
        assert m["type_mask"] == 0
    before = [m for t, m in radio.told if t < begun]
    assert {(m["x"], m["y"], m["z"]) for m in before} == {course.start.position}
    assert {m["vx"] for m in before} == {0.0}
