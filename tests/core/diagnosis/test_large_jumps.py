"""A jump as large as a third of gravity: named, placed to a sample or two, and out of the force."""

import functools

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Model
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec
from tests.core.diagnosis.flights import batches, flown

AT = 90.23
SIGMAS = 4.0
SIZES = {34: {"y": 3.6}, 33: {"z": 4.0}}
"""m/s^2, by seed; of planes whose EKF gives GPS up for it: half a minute, and until they land."""
FIRST_S = 1.0
"""First sample, s on the boot clock, which the simulator's times are of."""


@functools.cache
def diagnosed(seed):
    imus = random_imus(seed)
    step = concealed.BiasStep(time=AT, **SIZES[seed])
    spec = FlightSpec(vehicle="plane", seed=seed, duration=180.0, imus=imus, effects=(step,))
    return diagnose(heard(spec), 1), imus[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SIZES)
def test_a_large_jump_of_the_only_accelerometer_is_named(seed):
    d, truth = diagnosed(seed)
    (told,) = [e.unknowns for e in d.effects if e.name == "bias_step"]
    # Nothing stands in for what it does to the force: no clock, no gyroscope.
    assert {e.name for e in d.effects} <= {"bias_step", "gps_latency", "gps_smoothing"}
    assert "gyroscope" not in d.note
    for axis in "xyz":
        q = told[axis]
        assert abs(q.value - SIZES[seed].get(axis, 0.0)) < SIGMAS * np.hypot(q.sigma, 0.003)
    c = d.calibration
    off = np.subtract(c.scale + c.offset, truth.scale + truth.offset)
    assert np.all(np.abs(off) < SIGMAS * np.array(c.scale_sigma + c.offset_sigma))


def time_of(seed):
    (told,) = [e.unknowns["time"] for e in diagnosed(seed)[0].effects if e.name == "bias_step"]
    return told


@pytest.mark.slow
def test_it_is_placed_as_well_as_its_size_allows():
    """A jump of 4 m/s^2 that is 0.05 s off is a velocity of 0.2 m/s, which no receiver misses."""
    told = time_of(33)
    # The simulator's low-pass and telemetry at 50 Hz are a few hundredths of a second.
    assert told.value == pytest.approx(AT - FIRST_S, abs=0.06)
    assert told.sigma < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", SIZES)
def test_what_the_autopilots_filter_gave_up_for_it_is_used(seed):
    d, _ = diagnosed(seed)
    assert d.verdict is Verdict.EXPLAINED
    assert "complained of" in d.note
    assert d.calibration.rejected["ekf_gps_glitch"] > 200
    assert d.unused == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", SIZES)
def test_what_a_jump_bends_leaves_nothing_open(seed):
    """Beside a jump that is not taken off, effects that are not there explain what it bends."""
    d, _ = diagnosed(seed)
    assert "leaves open" not in d.note
    # What the same three minutes tell without a jump; offsets of a next flight differ by more.
    assert max(d.calibration.scale_sigma) < 0.01
    assert max(d.calibration.offset_sigma) < 0.04


def test_what_is_taken_off_the_samples_is_not_told_twice():
    true = flown(np.random.default_rng(3), 20.0)
    size = np.array([3.2, -0.4, 4.1])
    t = 100.0 + np.arange(len(true)) / 50.0
    # Its board lies on its side: its sensor's axes are not the body's.
    R_bs = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    scale = np.array([1.02, 0.97, 1.01])
    read = (true + np.outer(t >= 110.0, size)) @ R_bs / scale
    segment = batches(read, length_s=20.0, t0=100.0, R_bs=R_bs)[0].segment
    jump = BiasStep(Origin(t0=100.0)).at(110.0)
    left = jump.about(size).off_samples(segment, scale)
    inside = (t >= segment.t[0]) & (t <= segment.t[-1])
    np.testing.assert_allclose(left.raw_s * scale @ R_bs.T, true[inside], atol=1e-9)
    assert jump.off_samples(segment, scale) is segment
    # About what was taken off, the same jump is nothing; and its prior is where it was.
    about = jump.about(size).about(0.5 * size)
    found = Model([about])
    np.testing.assert_allclose(found.prior + found.taken_off, 0.0, atol=1e-12)
    theta, _ = found.taken_over(Model([jump]), size, np.eye(3))
    np.testing.assert_allclose(theta, 0.5 * size)
    nodes = Signals(t, np.zeros_like(read), read, read, segment)
    np.testing.assert_array_equal(about.acceleration(nodes), jump.acceleration(nodes))
