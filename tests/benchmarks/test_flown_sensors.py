"""Sensor errors that ArduPilot's SITL flies: drawn alike from a seed, scored by what is known."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from benchmarks.flown_sensors import ALWAYS, AXES, EFFECTS, TOLD_S, drawn, scored
from benchmarks.flown_weather import CONDITIONS, MOST, weather
from onboard.core.estimate.result import Status
from onboard.core.physics.catalogue import kind_of
from onboard.core.physics.finding import Quantity

SIGMA = 0.01
A_JUMP = next(seed for seed in range(100) if "bias_step" in drawn(seed).names)
NO_EFFECT = next(seed for seed in range(100) if not drawn(seed).names)
CHANGED = 60.0


@pytest.mark.parametrize("seed", range(20))
def test_a_seed_always_has_the_same_answer_and_another_one_another(seed):
    secret = drawn(seed)
    assert secret.seal == drawn(seed).seal
    assert secret.seal != drawn(seed + 1).seal
    assert len(secret.six) == 6
    assert {key.split(".")[0] for key in secret.truth} == secret.names
    assert all(kind_of(name) is not None for name in secret.names)


def test_every_effect_is_drawn():
    names = set().union(*(drawn(seed).names for seed in range(40)))
    assert len(names) == len(EFFECTS) - 1
    assert not names & ALWAYS


@pytest.mark.parametrize("seed", range(20))
def test_a_seed_has_one_weather_and_it_changes_nothing_that_is_asked(seed):
    secret = drawn(seed)
    words, parameters = weather(seed, secret.vehicle)
    assert (words, parameters) == weather(seed, secret.vehicle)
    assert 1 <= len(words) <= MOST
    # A receiver may have another rate; nothing else of what is told is another one.
    assert set(parameters) & set(secret.parameters) <= {"SIM_GPS1_HZ"}


def test_every_weather_is_drawn():
    words = {word for seed in range(60) for word in weather(seed, "copter")[0]}
    assert len(words) == len(CONDITIONS)


def found(secret, effects, off=0.0):
    """A diagnosis with these effects, each number of the six off by so many sigmas."""
    scale, offset = (
        tuple(secret.six[f"{name} {axis}"] + off * SIGMA for axis in AXES)
        for name in ("scale", "offset")
    )
    calibration = SimpleNamespace(
        scale=scale,
        offset=offset,
        scale_sigma=(SIGMA,) * 3,
        offset_sigma=(SIGMA,) * 3,
        status=Status.CALIBRATED,
    )
    made = [SimpleNamespace(name=n, unknowns=u) for n, u in effects.items()]
    return SimpleNamespace(calibration=calibration, effects=made)


def jump(secret, by=0.0, late=0.0):
    """The concealed jump, wrong by so many sigmas, and so late, s."""
    unknowns = {
        key.split(".")[1]: Quantity(true + by * SIGMA, SIGMA, "m/s^2")
        for key, true in secret.truth.items()
    }
    return {"bias_step": {"time": Quantity(CHANGED + late, 0.1, "s"), **unknowns}}


def test_what_is_right_is_right():
    secret = drawn(A_JUMP)
    score = scored(secret, found(secret, jump(secret, by=2.0), off=2.0), CHANGED)
    assert (score.six, score.named, score.right, score.numbers) == (6, 1, 2, 2)
    assert not score.words
    assert not score.false


def test_what_is_wrong_is_said():
    secret = drawn(A_JUMP)
    score = scored(
        secret, found(secret, jump(secret, by=90.0, late=2.0 * TOLD_S), off=4.0), CHANGED
    )
    assert (score.six, score.named, score.right, score.numbers) == (0, 1, 0, 2)
    assert len(score.words) == 8


def test_what_is_missing_and_what_is_too_much_is_said():
    secret = drawn(A_JUMP)
    wrong = {"clock_skew": {}, "gps_latency": {}}
    score = scored(secret, found(secret, wrong), CHANGED)
    assert (score.named, score.wanted, score.right, score.false) == (0, 1, 0, 1)
    assert score.words == ["missed bias_step", "false clock_skew"]


def test_a_flight_of_nothing_wants_nothing():
    secret = drawn(NO_EFFECT)
    score = scored(secret, found(secret, {"gps_latency": {}}), None)
    assert (score.wanted, score.numbers, score.false) == (0, 0, 0)
