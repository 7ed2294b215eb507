"""A sensor that has died repeats its last reading; one that is rounded or told twice does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.match_left_out import of_a_sensor
from onboard.core.vehicle.repeats import measured
from onboard.core.vehicle.signals import Stream
from tests.core.vehicle.flights import plane_flight

T = np.arange(0.0, 100.0, 0.1)
DIED_S = 60.0


def read(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 20.0 + np.convolve(rng.normal(size=len(T) + 20), np.ones(21) / 5.0, "valid")[: len(T)]


def stream(x: np.ndarray, t: np.ndarray = T) -> Stream:
    return Stream(t, np.asarray(x, dtype=float)[:, None])


def test_a_sensor_that_lives_is_left_as_it_is():
    alive = stream(read())
    assert measured(alive) == (alive, ())


def test_what_a_dead_one_repeats_is_not_kept():
    x = read()
    x[T >= DIED_S] = 100.24
    kept, dead = measured(stream(x))
    assert dead == ((pytest.approx(DIED_S), pytest.approx(T[-1])),)
    assert kept.t[-1] == pytest.approx(DIED_S)
    assert not kept.known(np.array([80.0]))[0]


def test_one_that_comes_back_is_missing_for_as_long():
    x = read()
    x[(T >= 40.0) & (T < 50.0)] = 0.0
    kept, dead = measured(stream(x))
    assert len(dead) == 1
    known = kept.known(np.array([30.0, 45.0, 60.0]))
    assert known.tolist() == [True, False, True]


@pytest.mark.parametrize("step", [0.1, 1.0, 5.0])
def test_rounded_readings_are_readings(step):
    rounded = stream(np.round(read() / step) * step)
    assert measured(rounded)[1] == ()


def test_readings_that_are_told_more_often_than_measured_are_readings():
    t = np.arange(0.0, 100.0, 0.02)
    held = stream(read()[(t / 0.1 + 1e-6).astype(int)], t)
    assert measured(held) == (held, ())


def test_nothing_is_known_long_before_the_first_reading_and_after_the_last():
    """The ends were held: what falls silent near the end of a flight went on for ever."""
    some = stream(read())
    assert some.known(np.array([-10.0, -0.5, 50.0, 100.5, 110.0])).tolist() == [
        *(False, True),
        *(True, True, False),
    ]


@pytest.mark.parametrize(("kind", "told"), [("plane", True), ("copter", False)])
def test_the_note_says_that_a_planes_sensor_has_died(kind, told):
    flight = replace(plane_flight(seconds=20.0), dead_s=12.0)
    said = of_a_sensor(flight, plane=kind == "plane")
    assert ("repeats one reading for 12 s" in said) is told
