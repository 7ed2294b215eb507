"""A vehicle that is struck: a velocity that samples have missed is no fault of the receiver."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.core.diagnosis.blows import Blows
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import Vibration
from onboard.mavlink.decode import Decoder
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.core.diagnosis.complaints import PROMPT

RATE = 2000.0
"""Of the raw samples, Hz."""


def reported(force, every):
    """What ArduPilot reports of raw samples (n, 3): times (k,) and levels (k, 3).

    A low-pass of 5 Hz is taken off, and what is left, squared, goes through one of 2 Hz.
    """
    floor, level = force[0].copy(), np.zeros(3)
    slow, quick = (1.0 - np.exp(-2.0 * np.pi * f / RATE) for f in (5.0, 2.0))
    t, levels = [], []
    for k, x in enumerate(force):
        floor += slow * (x - floor)
        level += quick * ((x - floor) ** 2 - level)
        if k % round(every * RATE) == 0:
            t.append(k / RATE)
            levels.append(np.sqrt(level))
    return np.array(t), np.array(levels)


def flown(force, every, spacing):
    """A flight of raw samples whose vibration is reported, and which is sampled, so often (s)."""
    t = np.arange(0.0, len(force) / RATE, spacing)
    slow = {"vibration": reported(force, every)}
    return [SimpleNamespace(segment=SimpleNamespace(t=t, slow=slow))]


def shaken(level, seconds=40.0):
    return np.random.default_rng(7).normal(0.0, level, (round(seconds * RATE), 3))


def struck(force, at, lasts, by):
    """The same with a force that changes the velocity by ``by`` (m/s) along a slanting axis."""
    out, first, n = force.copy(), round(at * RATE), max(round(lasts * RATE), 1)
    pulse = np.sin(np.pi * (np.arange(n) + 0.5) / n)
    axis = np.array([0.6, -0.48, 0.64])
    out[first : first + n] += by * RATE * (pulse / pulse.sum())[:, None] * axis
    return out


@pytest.mark.parametrize("lasts", [0.002, 0.01, 0.03])
@pytest.mark.parametrize("at", [20.0, 20.03, 20.07, 20.0995])
def test_no_blow_is_larger_than_what_the_vibration_leaves_room_for(lasts, at):
    made = Blows(flown(struck(shaken(0.5), at, lasts, 0.6), 0.1, 0.04))
    assert made.near(at, 0.2) > 0.6
    assert made.near(at - 5.0, 0.2) < 0.3


def test_a_vehicle_that_shakes_all_the_time_is_not_struck_all_the_time():
    made = Blows(flown(shaken(20.0), 0.1, 0.04))
    struck_at = [t for t in np.arange(1.0, 39.0, 0.5) if made.near(t, 0.2) > 0.3]
    assert len(struck_at) < 0.15 * len(np.arange(1.0, 39.0, 0.5))


def test_what_is_sampled_often_is_not_missed():
    force = struck(shaken(0.5), 20.03, 0.01, 0.6)
    assert Blows(flown(force, 0.1, 0.001)).near(20.03, 0.2) < 0.25


@pytest.mark.parametrize("slow", [{}, {"vibration": (np.array([1.0]), np.ones((1, 3)))}])
def test_nothing_is_known_of_blows_where_vibration_is_not_reported(slow):
    flight = [SimpleNamespace(segment=SimpleNamespace(t=np.arange(0.0, 9.0, 0.04), slow=slow))]
    assert Blows(flight).near(5.0, 9.0) == 0.0


def jumped(blow):
    """A flight whose GPS velocity jumps 40 s before its end, and what is said of it.

    ``blow`` is what is added to the vibration that is reported from then on, m/s^2.
    """
    fault = concealed.GpsFault(start=90.0, end=600.0, north=0.6, east=-0.5)
    spec = FlightSpec(
        vehicle="copter",
        seed=4723,
        duration=130.0,
        imus=random_imus(4723),
        gps=PROMPT,
        effects=(fault,),
    )
    made, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            if isinstance(sample, Vibration) and sample.t >= 90.0:
                more = blow * np.exp(-2.0 * np.pi * (sample.t - 90.0))
                level = tuple(np.hypot(x, more) for x in sample.level)
                made.feed(replace(sample, level=level))
            else:
                made.feed(sample)
    made.finish()
    return diagnose(made, 1), made.first_sample


@pytest.mark.slow
def test_a_velocity_that_jumps_once_is_the_receivers_unless_the_vehicle_was_struck():
    said, first = jumped(0.0)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    assert "struck" not in said.note
    said, _ = jumped(40.0)
    assert said.effects == ()
    assert f"(at {90.0 - first:.0f} s)" in said.note
    c, (truth, *_) = said.calibration, random_imus(4723)
    off = np.array([*c.scale, *c.offset]) - [*truth.scale, *truth.offset]
    assert np.all(np.abs(off) < 3.5 * np.array([*c.scale_sigma, *c.offset_sigma]))
