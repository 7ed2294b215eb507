"""A receiver that overshoots: its columns, what they are nothing of, and flights that conceal it.

The concealed receiver goes from sample to sample by the two equations of its loop; the columns
weigh the past.  They share the law and nothing else.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.concealing import Secret
from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.inputs.limits import AROUND_S
from onboard.core.model.around import Past
from onboard.core.model.smoothing import Gained
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.accelerometer_hysteresis import AccelerometerHysteresis
from onboard.core.physics.effects.gps_overshoot import DAMPING, NATURAL_HZ, GpsOvershoot
from onboard.core.physics.effects.temperature_drift import TemperatureDrift
from onboard.core.physics.octaves import WEIGHTS
from sitl.builtin.effects import GpsOvershoot as Concealed
from sitl.builtin.gps import _loop

STEP_S = 0.001
SQUARES = [(2.0 * math.pi * hertz) ** -2 for hertz in NATURAL_HZ]
EPOCHS = np.arange(2.0, 18.0, 0.2)


def past(velocity):
    """What the columns see of a velocity (n, 3) that is sampled every millisecond."""
    force = np.gradient(velocity, STEP_S, axis=0)
    return Past(Gained(0.0, STEP_S, force), EPOCHS, np.broadcast_to(np.eye(3), (len(EPOCHS), 3, 3)))


def columns(velocity):
    """(K, 3, 3) m/s by one unit of size and shapes."""
    around = SimpleNamespace(past=past(velocity))
    return GpsOvershoot(Origin(t0=0.0)).velocity(around).body


def manoeuvres(seconds=20.0, quickest=1.0):
    """A velocity that goes to and fro by several m/s, as vehicles do."""
    t = np.arange(0.0, seconds, STEP_S)
    rng = np.random.default_rng(11)
    hertz = rng.uniform(0.05, quickest, (3, 12))
    phase = rng.uniform(0.0, 2.0 * math.pi, hertz.shape)
    return t, np.sum(0.6 / hertz * np.sin(2.0 * math.pi * hertz * t[:, None, None] + phase), axis=2)


def unknowns_of(square):
    """Size and shapes of one loop alone, of those that the effect has."""
    alone = np.where(np.isclose(SQUARES, square), square, 0.0)
    return np.linalg.solve(WEIGHTS.T, alone)


@pytest.mark.parametrize(("square", "share"), [*zip(SQUARES, (0.08, 0.02, 0.04), strict=True)])
def test_its_columns_are_what_a_loop_adds_to_the_velocity(square, share):
    t, velocity = manoeuvres()
    looped = np.column_stack([_loop(u, square, DAMPING) for u in velocity.T])
    at = np.searchsorted(t, EPOCHS - 1e-9)
    added = (looped - velocity)[at]
    found = columns(velocity) @ unknowns_of(square)
    # A slow loop remembers more of the past than there is; a quick one has twenty steps a swing.
    assert np.sqrt(np.mean((found - added) ** 2)) < share * np.sqrt(np.mean(added**2))


def test_of_a_steady_jerk_the_size_is_the_whole_and_the_shapes_are_nothing():
    t = np.arange(0.0, 20.0, STEP_S)
    jerk = np.array([0.3, -0.1, 0.2])
    velocity = np.outer(0.5 * t**2, jerk)
    found = columns(velocity)
    assert found[..., 0] == pytest.approx(np.broadcast_to(-jerk, (len(EPOCHS), 3)), abs=1e-3)
    assert np.abs(found[..., 1:]).max() < 1e-3
    looped = _loop(velocity[:, 0], SQUARES[0], DAMPING) - velocity[:, 0]
    assert looped[-1] == pytest.approx(-SQUARES[0] * jerk[0], rel=1e-3)


@pytest.mark.parametrize("rate", [0.0, 3.0])
def test_nothing_is_seen_of_a_steady_velocity_or_acceleration(rate):
    t = np.arange(0.0, 20.0, STEP_S)
    velocity = np.outer(rate * t + 20.0, [1.0, 0.5, -0.3])
    assert np.abs(columns(velocity)).max() < 1e-9
    assert _loop(velocity[:, 0], SQUARES[0], DAMPING) == pytest.approx(velocity[:, 0], abs=1e-9)


def test_no_more_of_the_past_is_asked_for_than_there_is():
    effect = GpsOvershoot(Origin(t0=0.0))
    assert effect._before.min() > 0.0
    assert effect._before.max() < AROUND_S


@pytest.mark.slow
def test_a_flight_that_conceals_it_is_explained_by_its_name():
    concealed = Concealed(square=(2.0 * math.pi * 2.0) ** -2)
    spec = Secret(641, "copter", "control").spec()
    said = diagnose(heard(replace(spec, effects=(concealed,))), 1)
    assert [e.name for e in said.effects] == ["gps_overshoot"]
    found = said.effects[0].unknowns["square"]
    assert abs(found.value - concealed.square) < max(0.1 * concealed.square, 3.0 * found.sigma)
    truth = spec.imus[0]
    off = np.array(said.calibration.scale) - truth.scale
    assert np.all(np.abs(off) < 3.5 * np.array(said.calibration.scale_sigma))
    assert said.mismatch.held_out_after < said.mismatch.held_out_before


def test_shapes_without_a_size_are_no_loop():
    """No loop has less than nothing, so what three of them share is nothing without a sum."""
    made = GpsOvershoot(Origin(t0=0.0))
    sigma = np.array([1.4e-4])
    assert not made.there(np.array([-5e-5]), sigma)
    assert not made.there(np.array([4e-4]), sigma)
    assert made.there(np.array([5e-4]), sigma)
    assert made.there(np.array([-5e-4]), sigma), "what is the other way round is said to be"


def test_an_axis_with_hysteresis_is_enough_and_a_slope_may_be_none_of_a_curve():
    sigma = np.full(3, 0.01)
    made = AccelerometerHysteresis(Origin(t0=0.0))
    assert made.there(np.array([0.0, 0.1, -0.01]), sigma)
    assert not made.there(np.array([0.02, -0.01, 0.0]), sigma)
    assert TemperatureDrift(Origin(t0=0.0)).there(np.zeros(3), sigma)
