"""A jump of the scale is told from one of the offset, for which level flight takes it."""

import numpy as np
import pytest

from onboard.answers.answer import answer
from onboard.core.estimate.result import Status
from onboard.core.model.quadrature import Signals
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.scale_step import ScaleStep
from sitl.builtin import effects as concealed
from sitl.builtin.truth import ImuTruth
from tests.core.diagnosis.flights import batches, flown
from tests.core.estimate.test_simulated_flights import fed
from tests.core.estimate.test_simulated_flights import flown as simulated

IMU = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SIX = np.array(IMU.scale + IMU.offset)
AT = 105.0


def test_about_its_size_the_columns_give_the_force_back():
    true = flown(np.random.default_rng(3), 20.0)
    size = np.array([0.02, -0.03, 0.01])
    t = 100.0 + np.arange(len(true)) / 50.0
    read = true * (1.0 + np.outer(t >= 110.0, size))
    nodes = Signals(t, np.zeros_like(read), read, read, batches(read)[0].segment)
    step = ScaleStep(Origin(t0=100.0)).at(110.0, 0.5).about(size)
    before = t < 110.0
    assert not step.acceleration(nodes)[before].any()
    assert np.any(read[~before] - true[~before])
    # What was taken off to first order leaves the third.
    assert read + step.acceleration(nodes) @ size == pytest.approx(true, abs=30.0 * 0.03**3)


def asked(vehicle, effect):
    samples = simulated(vehicle, 200.0, seed=9, imu=IMU, effects=[effect])[0]
    found = answer(fed(samples), 1)
    assert found.calibration.status is not Status.CALIBRATED, "it is not the same in all the flight"
    (told,) = [e for e in found.diagnosis.effects if e.name != "gps_latency"]
    return found, told


@pytest.mark.slow
def test_a_jump_of_the_scale_is_one():
    size = 0.02, 0.02, 0.02
    step = concealed.ScaleStep(time=AT, **dict(zip("xyz", size, strict=True)))
    found, told = asked("copter", step)
    assert told.name == "scale_step"
    for axis, true in zip("xyz", size, strict=True):
        q = told.unknowns[axis]
        assert abs(q.value - true) < max(3.5 * q.sigma, 0.1 * abs(true))
    c = found.calibration
    off = (np.array(c.scale + c.offset) - SIX) / np.array(c.scale_sigma + c.offset_sigma)
    assert np.max(np.abs(off)) < 3.5
    assert told.unknowns["time"].value == pytest.approx(AT, abs=3.0)


@pytest.mark.slow
def test_a_jump_of_the_offset_that_level_flight_takes_for_one_of_the_scale_is_none():
    _, told = asked("plane", concealed.BiasStep(time=AT, z=0.2))
    assert told.name == "bias_step"
    assert told.unknowns["z"].value == pytest.approx(0.2, abs=0.02)
