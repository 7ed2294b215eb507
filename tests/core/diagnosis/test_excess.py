"""Noise that is larger than noise of its kind is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.verdict import headline
from onboard.core.diagnosis.excess import WORDS, excess_in_words, spoils
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import ESTIMATED, NO_VARIANCES, NoiseLevels
from onboard.core.inputs.samples import AttitudeSample
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages


def test_every_level_that_is_looked_for_has_words_but_the_time():
    assert set(WORDS) == set(ESTIMATED) - set(NO_VARIANCES)


@pytest.mark.parametrize("name", sorted(WORDS))
def test_a_level_is_in_excess_at_its_highest_and_not_below(name):
    low, high = LIMITS[name]
    assert WORDS[name] in excess_in_words(replace(NoiseLevels(), **{name: high}))
    assert not excess_in_words(replace(NoiseLevels(), **{name: math.sqrt(low * high)}))
    assert not excess_in_words(replace(NoiseLevels(), **{name: low}))


@pytest.mark.parametrize("name", ["heading_time", "vertical"])
def test_an_error_of_the_heading_may_last_for_the_flight_and_a_ratio_is_no_noise(name):
    assert not excess_in_words(replace(NoiseLevels(), **{name: LIMITS[name][1]}))


def test_a_heading_spoils_nothing_of_an_accelerometer():
    assert not spoils(replace(NoiseLevels(), heading=0.6))
    assert spoils(replace(NoiseLevels(), heading=0.6, bias_walk=3e-3))
    assert not spoils(NoiseLevels())


def test_what_is_alike_is_said_once():
    both = replace(NoiseLevels(), velocity=2.0, velocity_colour=1.0, heading=0.6)
    assert excess_in_words(both).count("GPS") == 1
    assert " and the autopilot's heading" in excess_in_words(both)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "wrong"), [(0.05, False), (1.2, True)])
def test_a_heading_that_wanders_by_a_radian_is_said(size, wrong):
    """Of three degrees it is what compasses do; of seventy a filter can make a perfect fit, too."""
    spec = FlightSpec(vehicle="copter", seed=5, duration=110.0, imus=random_imus(5))
    made, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            if isinstance(sample, AttitudeSample):
                wander = size * math.sin(0.11 * sample.t) * math.cos(0.047 * sample.t)
                sample = replace(sample, yaw=sample.yaw + wander)  # noqa: PLW2901
            made.feed(sample)
    made.finish()
    said = diagnose(made, 1)
    assert ("heading is off by more than" in said.note) is wrong
    assert headline(said).endswith(", but the heading is wrong") is (
        wrong and said.verdict is Verdict.CLEAN
    )


def test_a_gyroscope_is_not_blamed_for_an_attitude_that_the_accelerometer_has_misled():
    loud = replace(NoiseLevels(), bias_walk=LIMITS["bias_walk"][1])
    assert "gyroscope" in excess_in_words(loud)
    assert "gyroscope" not in excess_in_words(loud, misled=True)
    assert "roll and pitch" in excess_in_words(loud, misled=True)
    jump = BiasStep(Origin(t0=0.0)).at(50.0)
    assert not jump.misleads_ekf
    assert not jump.about(np.array([0.9, 0.0, -0.5])).misleads_ekf
    assert jump.about(np.array([0.0, -3.0, 0.0])).misleads_ekf
