"""The ways up to and down from recorded flights that begin or end in the air."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.smoothing import DT
from sitl.course import Course
from sitl.ends import BRAKE_M_S2, STEP_S, grounded, way_down
from sitl.plane_ends import GAIN_M_S2, LEAST_M_S, PULL_M_S2, SINK_M_S, TOUCH_M_S, landing
from sitl.recorded_motion import recorded_motion

HEIGHT, SPEED, SECONDS = 40.0, 5.0, 60.0
FLYING = 0.5


def circle():
    """(n, 4) velocities and (n, 2) heights of a circle that rises and sinks, all of it aloft."""
    t = np.arange(0.0, SECONDS, 0.1)
    way, swing = 0.2 * t, 2.0 * np.pi * t / 30.0
    rise = 4.0 * 2.0 * np.pi / 30.0
    v = np.column_stack([t, SPEED * np.cos(way), SPEED * np.sin(way), -rise * np.cos(swing)])
    return v, np.column_stack([t, HEIGHT + 4.0 * np.sin(swing)])


def standing(v, heights, before):
    """The same with ten seconds on the ground before it, or after it."""
    t = np.arange(0.0, 10.0, 0.1) + (v[0, 0] - 10.0 if before else v[-1, 0] + 0.1)
    still, low = np.column_stack([t, np.zeros((len(t), 3))]), np.column_stack([t, 0.0 * t + 7.0])
    order = (still, v) if before else (v, still)
    levels = (low, heights) if before else (heights, low)
    return np.concatenate(order), np.concatenate(levels)


@pytest.mark.parametrize("v_n", [(0.0, 0.0, 0.0), (5.0, -9.0, 2.0), (1.0, 0.0, -4.0)])
@pytest.mark.parametrize("height", [0.0, 3.0, 58.0])
def test_a_way_down_ends_at_rest_on_the_ground_and_asks_for_no_more_than_a_copter_can(v_n, height):
    way = way_down(np.array(v_n), height)
    assert np.linalg.norm(way[-1, 1:]) < 0.05
    sunk = STEP_S * np.sum(way[:, 3])
    # What it was sinking with when the ground was too near to stop is the rest.
    stop = max(v_n[2], 0.0) ** 2 / (2.0 * BRAKE_M_S2)
    assert height - 0.2 <= sunk <= max(height, stop) + 2.0
    told = np.vstack([v_n, way[:, 1:]])
    change = np.linalg.norm(np.diff(told[:, :2], axis=0), axis=1)
    assert change.max() <= BRAKE_M_S2 * STEP_S + 1e-9


def test_a_flight_from_the_ground_to_the_ground_stays_as_it_is():
    v, heights = standing(*standing(*circle(), before=True), before=False)
    assert np.array_equal(grounded(v, heights, FLYING), v)


def test_without_heights_nobody_knows_a_way():
    v, _ = circle()
    assert grounded(v, np.zeros((0, 2)), FLYING) is v


@pytest.mark.parametrize("before", [True, False])
def test_heights_are_those_above_where_it_stood(before):
    v, heights = standing(*circle(), before=before)
    way = grounded(v, heights, FLYING)
    extra = way[len(v) :, 3] if before else way[: -len(v), 3]
    assert abs(STEP_S * np.sum(extra)) == pytest.approx(HEIGHT - 7.0, abs=1.0)


def tlog(path, kind, v, heights, angles=lambda t: (0.0, 0.0, 0.0)):
    """A recording of velocities, heights and attitudes."""
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:
        beat = mav.MAVLink_heartbeat_message(kind, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 0, 3)
        messages = [(0.0, beat)]
        for (t, *its), (_, height) in zip(v.tolist(), heights.tolist(), strict=True):
            ms = round(1e3 * t)
            place = mav.MAVLink_local_position_ned_message(ms, 0.0, 0.0, -height, *its)
            attitude = mav.MAVLink_attitude_message(ms, *angles(t), 0.0, 0.0, 0.0)
            messages += [(t, place), (t, attitude)]
        for t, message in messages:
            file.write(struct.pack(">Q", round(1e6 * t)) + message.pack(packer))
    return path


def test_a_flight_that_begins_and_ends_in_the_air_is_flown_again_at_its_height(tmp_path):
    v, heights = circle()
    motion = recorded_motion(
        tlog(tmp_path / "aloft.tlog", mav.MAV_TYPE_QUADROTOR, v, heights)
    ).motion
    flown = -DT * np.cumsum(motion.v_n[:, 2])
    assert flown[0] == pytest.approx(0.0, abs=0.01)
    assert flown[-1] == pytest.approx(0.0, abs=0.01)
    fast = np.flatnonzero(np.hypot(*motion.v_n[:, :2].T) > 0.99 * SPEED)
    inside = slice(fast[0] + 2000, fast[-1] - 2000)
    assert flown[inside].min() > HEIGHT - 5.5
    assert flown[inside].max() < HEIGHT + 5.5
    assert np.max(Course.of(motion).position[:, 2]) < -9.0


TURN = 0.3
"""rad/s."""


def turning(speed, climb, seconds=20.0):
    """(n, 4) velocities of a plane in a turn that climbs or sinks."""
    t = np.arange(0.0, seconds, 0.1)
    way = TURN * t
    return np.column_stack([t, speed * np.cos(way), speed * np.sin(way), 0.0 * t - climb])


@pytest.mark.parametrize("climb", [-4.0, 0.0, 4.0])
@pytest.mark.parametrize("speed", [9.0, 18.0, 31.0])
@pytest.mark.parametrize("height", [20.0, 120.0])
def test_a_plane_comes_down_as_one_that_flies(height, speed, climb):
    flown = turning(speed, climb)
    way = landing(flown, height)
    step = way[1, 0] - way[0, 0]
    told = np.vstack([flown[-1], np.column_stack([flown[-1, 0] + way[:, 0], way[:, 1:]])])
    sunk = np.cumsum(step * way[:, 3])
    assert sunk[-1] == pytest.approx(height, abs=0.2)
    assert np.linalg.norm(way[-1, 1:]) < 1e-9
    over = np.hypot(told[:, 1], told[:, 2])
    aloft = np.concatenate([[True], sunk < height - 0.2])
    # As fast through the air as it was; where that would look like standing, a little faster.
    assert over[aloft].min() >= speed - 1e-9
    assert over[aloft].max() <= max(speed, LEAST_M_S) + 1e-9
    assert np.diff(over).max() <= GAIN_M_S2 * step + 1e-9
    assert np.abs(np.diff(told[aloft, 3])).max() <= PULL_M_S2 * step + 1e-9
    assert told[:, 3].max() <= max(SINK_M_S, -climb) + 1e-9
    assert way[sunk < height - 1e-9][-1, 3] < TOUCH_M_S + 0.1
    course = np.unwrap(np.arctan2(told[aloft, 2], told[aloft, 1]))
    assert np.abs(np.diff(course)).max() < 1.01 * TURN * step
    assert course[-1] == pytest.approx(course[-2], abs=1e-9)


def test_a_plane_that_is_recorded_in_the_air_is_flown_again_at_its_height(tmp_path):
    v = turning(20.0, 0.0, SECONDS)
    heights = np.column_stack([v[:, 0], HEIGHT + 0.0 * v[:, 0]])
    bank = float(np.arctan(20.0 * TURN / 9.81))
    path = tlog(
        tmp_path / "plane.tlog",
        mav.MAV_TYPE_FIXED_WING,
        v,
        heights,
        lambda t: (bank, 0.0, (TURN * t + np.pi) % (2.0 * np.pi) - np.pi),
    )
    motion = recorded_motion(path).motion
    flown = -DT * np.cumsum(motion.v_n[:, 2])
    assert flown[-1] == pytest.approx(0.0, abs=0.01)
    course = np.unwrap(np.arctan2(motion.v_n[:, 1], motion.v_n[:, 0]))
    turns = np.gradient(course[~motion.landed], DT) > 0.99 * TURN
    assert flown[~motion.landed][turns] == pytest.approx(HEIGHT, abs=1.0)
    assert DT * np.sum(turns) > SECONDS - 2.0
    # Wings are level on the ways up and down, and as they were in between.
    assert motion.bank[~motion.landed][turns].max() == pytest.approx(bank, abs=0.02)
    assert np.abs(motion.bank[motion.landed]).max() < 0.02
    assert np.linalg.norm(motion.v_n[[0, -1]], axis=1).max() < 0.5
