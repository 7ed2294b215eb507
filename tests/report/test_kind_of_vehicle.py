"""What a vehicle is, where the recording does not say: by what it does in the air."""

from types import SimpleNamespace

import numpy as np
import pytest

from onboard.answers.match import guessed_kind


def flown(speed, height):
    """Batches of fixes, five a second, of speeds (m/s) and heights (m)."""
    speed, height = (np.concatenate([np.asarray(x, float) for x in y]) for y in (speed, height))
    v_n = np.zeros((len(speed), 3))
    v_n[:, 1] = speed
    t = 0.2 * np.arange(len(speed))
    parts = np.array_split(np.arange(len(t)), 6)
    return [
        SimpleNamespace(fixes=SimpleNamespace(t=t[p], v_n=v_n[p], height=height[p])) for p in parts
    ]


GROUND = np.full(900, 120.0)
ALOFT = np.full(600, 160.0)


def test_a_plane_that_stands_longer_than_it_flies_is_a_plane():
    wander = np.random.default_rng(3).normal(0.0, 1.5, 1500)
    heights = [GROUND + wander[:900], ALOFT + wander[900:]]
    assert guessed_kind(flown([np.zeros(900), 14.0 + wander[900:]], heights)) == "plane"


def test_a_copter_that_hovers_now_and_then_is_a_copter():
    speeds = [np.zeros(900), np.full(500, 12.0), np.zeros(100)]
    assert guessed_kind(flown(speeds, [GROUND, ALOFT])) == "copter"


def test_what_flies_low_is_asked_as_a_whole():
    assert guessed_kind(flown([np.linspace(0.0, 6.0, 900)], [GROUND])) == "copter"
    assert guessed_kind(flown([np.full(900, 15.0)], [GROUND])) == "plane"


def test_a_wild_height_is_no_flight():
    height = GROUND.copy()
    height[:5] = 4000.0
    speed = np.zeros(900)
    speed[:5] = 30.0
    assert guessed_kind(flown([speed], [height])) == "copter"


@pytest.mark.parametrize("speed", [4.0, 5.0, 6.5])
def test_what_is_neither_slow_nor_fast_is_not_said(speed):
    assert guessed_kind(flown([np.full(600, speed)], [ALOFT])) == ""


def test_without_heights_or_fixes_nothing_breaks():
    assert guessed_kind([]) == ""
    assert guessed_kind(flown([np.full(600, 15.0)], [np.full(600, np.nan)])) == "plane"
