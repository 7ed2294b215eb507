"""Whether two by two the quantities of a recording are of one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.maths.earth import SEMI_MAJOR_AXIS
from onboard.core.maths.frames import rotation_from_euler, vector_from_rotation
from onboard.core.vehicle.same_motion import Recorded, disagreement
from tests.core.vehicle.flights import G, smooth

LATITUDE = 0.8


def flown(seed=1, seconds=120.0, speed=4.0, lean=0.2, rate=10.0, gusts=0.0):
    """A motion whose quantities follow from each other, at 10 Hz, with noise of sensors.

    Gusts are up and down, and others after a sixth of a second.
    """
    rng = np.random.default_rng(seed)
    n = int(seconds * rate)
    t = np.arange(n) / rate
    v = np.stack([smooth(rng, n, speed), smooth(rng, n, speed), smooth(rng, n, 0.4 * speed)], 1)
    if gusts > 0.0:
        v[:, 2] += smooth(rng, n, gusts, 0.1)
    angles = [smooth(rng, n, lean), smooth(rng, n, lean), smooth(rng, n, 3.0 * lean, 4.0)]
    R = rotation_from_euler(*angles)
    a = np.gradient(v, t, axis=0)
    f = np.einsum("nji,nj->ni", R, a - np.array([0.0, 0.0, G]))
    w = np.zeros((n, 3))
    turned = np.swapaxes(R[:-2], -1, -2) @ R[2:]
    w[1:-1] = 0.5 * rate * vector_from_rotation(turned)
    p = np.cumsum(v, axis=0) / rate
    place = np.column_stack(
        [
            LATITUDE + p[:, 0] / SEMI_MAJOR_AXIS,
            p[:, 1] / SEMI_MAJOR_AXIS / np.cos(LATITUDE),
            100.0 - p[:, 2],
        ]
    )

    def rows(x, noise):
        return np.column_stack([t, x + noise * rng.normal(size=x.shape)])

    return Recorded(
        force=rows(f, 0.2),
        rates=rows(w, 0.01),
        attitude=rows(np.column_stack(angles), 0.002),
        position=np.column_stack([t, place]),
        velocity=rows(v, 0.05),
    )


def changed(recorded, name, by):
    rows = getattr(recorded, name)
    return replace(recorded, **{name: np.column_stack([rows[:, 0], by(rows[:, 1:])])})


def turned_over(recorded):
    """The same with the other frame of the body: left and up for right and down."""
    other = np.array([1.0, -1.0, -1.0])
    for name in ("force", "rates"):
        recorded = changed(recorded, name, lambda x: x * other)
    return changed(recorded, "attitude", lambda x: x + np.array([np.pi, 0.0, 0.0]))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("speed", [0.02, 0.5, 4.0])
def test_a_flight_of_one_motion_has_nothing_said_of_it(seed, speed):
    assert disagreement(flown(seed, speed=speed, lean=0.05 * speed)) is None


def test_sensors_that_nobody_calibrated_contradict_nothing():
    its = flown(3)
    its = changed(its, "force", lambda f: 1.02 * f + 0.4)
    its = changed(its, "rates", lambda w: 1.03 * w + 0.03)
    its = changed(its, "attitude", lambda a: a + 0.03)
    late = replace(its, velocity=its.velocity + np.array([0.2, 0.0, 0.0, 0.0]))
    assert disagreement(late) is None


@pytest.mark.parametrize(
    ("name", "by", "pair", "hint"),
    [
        ("rates", lambda w: w * [-1.0, 1.0, 1.0], ("attitude", "rates"), "forward of the rates"),
        ("rates", lambda w: w * np.pi / 180, ("attitude", "rates"), "rates said that nothing"),
        ("rates", lambda w: w * 4.0, ("attitude", "rates"), "unit of the rates"),
        ("attitude", lambda a: 0.0 * a, ("attitude", "rates"), "attitude said that nothing moves"),
        ("velocity", lambda v: 0.0 * v, ("position", "velocity"), "velocity said that nothing"),
        (
            "velocity",
            lambda v: 1.944 * v,
            ("position", "velocity"),
            "unit of the velocity were 0.5",
        ),
        ("velocity", lambda v: v[:, [1, 0, 2]], ("position", "velocity"), "north and east"),
        ("velocity", lambda v: v * [1.0, 1.0, -1.0], ("position", "velocity"), "down of the veloc"),
        ("force", lambda f: -f, ("force", "velocity"), ""),
    ],
)
def test_what_is_not_of_the_motion_is_named_with_what_would_make_it_so(name, by, pair, hint):
    found = disagreement(changed(flown(5), name, by))
    assert found is not None
    assert found.names == pair
    assert hint in found.hint


def test_a_world_that_is_upside_down_is_not_the_force_s():
    """North-east-down read as east-north-up: the level axes agree, gravity does not."""
    its = changed(flown(6), "velocity", lambda v: v[:, [1, 0, 2]] * [1.0, 1.0, -1.0])

    def turned(angles):
        ned = rotation_from_euler(*angles.T)
        R = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]) @ ned
        roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
        yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
        return np.column_stack([roll, -np.arcsin(R[:, 2, 0]), yaw])

    its = changed(its, "attitude", turned)
    found = disagreement(replace(its, position=its.position[:0]))
    assert found is not None
    assert found.names == ("force", "velocity")
    assert found.size == pytest.approx(2.0 * G, rel=0.05)
    assert "world" in found.hint


def test_a_body_that_is_turned_over_agrees_with_itself_and_carries_nothing():
    found = disagreement(turned_over(flown(7)))
    assert found is not None
    assert "body" in found.hint


def test_a_receiver_that_lags_in_gusts_contradicts_nothing():
    """Down, its velocity of 0.4 s ago has next to nothing to do with that of now."""
    its, lag = flown(4, gusts=4.0), np.array([0.4, 0.0, 0.0, 0.0])
    late = replace(its, velocity=its.velocity + lag, position=its.position + lag)
    assert disagreement(late) is None
    for wrong in (lambda f: -f, lambda f: 2.0 * f, lambda f: f * [1.0, 1.0, -1.0]):
        assert disagreement(changed(late, "force", wrong)).names == ("force", "velocity")


def test_a_glitch_of_seconds_is_no_contradiction():
    its = flown(8)
    its.velocity[300:360, 1:] += 20.0
    assert disagreement(its) is None


def test_a_recording_without_a_quantity_contradicts_nothing():
    its, none = flown(9), np.zeros((0, 4))
    names = ("force", "rates", "attitude", "position", "velocity")
    for name in names:
        assert disagreement(replace(its, **{name: none})) is None
    assert disagreement(Recorded(none, none, none, none, none)) is None
    its.velocity[:, 3] = np.nan
    assert disagreement(its) is None
