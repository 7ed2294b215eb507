"""Readings in coarse steps: measured from the samples, and never claimed finer than they are."""

import numpy as np
import pytest

from onboard.answers.answer import answer
from onboard.core.diagnosis.coarse_readings import COARSE, Conversion, coarse_of, steps_of
from onboard.core.estimate.result import Status
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.model.quadrature import Signals
from sitl.builtin.effects import AccelerometerResolution
from sitl.builtin.truth import ImuTruth
from tests.core.diagnosis.flights import batches, flown, resting
from tests.core.estimate.test_simulated_flights import fed
from tests.core.estimate.test_simulated_flights import flown as simulated

IMU = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SIX = np.array(IMU.scale + IMU.offset)
MILLI_G = 9.80665e-3
WHOLE = {"toward_zero": np.trunc, "down": np.floor, "nearest": np.rint}


@pytest.fixture
def rng():
    return np.random.default_rng(4)


@pytest.mark.parametrize("cut", WHOLE.values(), ids=WHOLE)
@pytest.mark.parametrize("step", [0.049, 0.2])
def test_a_coarse_step_is_measured_however_it_was_cut(rng, step, cut):
    read = cut(flown(rng, 120.0) / step) * step
    assert steps_of(batches(read)) == pytest.approx([step] * 3, rel=1e-6)


@pytest.mark.parametrize("step", [1e-6, MILLI_G, 0.8 * COARSE])
def test_a_fine_step_is_none_that_matters(rng, step):
    assert not steps_of(batches(np.trunc(flown(rng, 120.0) / step) * step)).any()


def test_a_violent_flight_of_few_samples_is_not_coarse(rng):
    read = 20.0 * rng.normal(size=(400, 3))
    assert not steps_of(batches(read, rate=5.0, fix_rate=1.0)).any()


def test_only_the_axis_that_is_coarse_has_a_step(rng):
    read = flown(rng, 120.0)
    read[:, 1] = np.rint(read[:, 1] / 0.1) * 0.1
    assert steps_of(batches(read)) == pytest.approx([0.0, 0.1, 0.0])


def test_coarse_steps_are_seen_through_the_finer_ones_of_a_message(rng):
    coarse = np.rint(flown(rng, 120.0) / 0.05) * 0.05
    read = np.trunc(coarse / MILLI_G) * MILLI_G
    assert steps_of(batches(read)) == pytest.approx([0.05] * 3, rel=0.03)


def test_parameters_that_change_in_flight_hide_no_step(rng):
    read = np.trunc(flown(rng, 120.0) / 0.1) * 0.1
    read[3000:] = read[3000:] / 1.02 + 0.033
    assert steps_of(batches(read)) == pytest.approx([0.1] * 3, rel=0.03)


def test_some_readings_may_be_far_apart_by_chance(rng):
    read = np.rint(flown(rng, 1.2, rate=10.0) / 0.1) * 0.1
    assert not steps_of(batches(read, rate=10.0)).any()


def test_readings_that_stand_still_say_nothing(rng):
    at_rest = resting(rng, 60.0, noise=0.0)
    assert coarse_of(batches(at_rest), SixParameters()) is None


@pytest.mark.parametrize(
    ("cut", "fractions"),
    [("toward_zero", (1.0, 0.0)), ("down", (0.0, 1.0)), ("nearest", (0.0, 0.0))],
)
def test_in_the_mean_the_columns_give_back_what_was_cut_off(rng, cut, fractions):
    scale, offset, step = 1.02, 0.3, 0.2
    true = rng.uniform(-3.0, 3.0, (200_000, 3))
    reported = WHOLE[cut](true / step) * step
    flight = batches(reported[:100] / scale + offset)[0].segment
    nodes = Signals(np.arange(len(true)), true, reported / scale + offset, reported, flight)
    family = Conversion(np.full(3, step / scale), np.full(3, offset))
    columns = family.acceleration(nodes)
    zero, down = fractions
    back = reported / scale + columns @ np.array([zero, down, down, down])
    for sign in (-1.0, 1.0):
        away = np.sign(true) == sign
        off = np.where(away & (np.abs(true) > step), back - true / scale, np.nan)
        assert np.nanmean(off, axis=0) == pytest.approx(np.zeros(3), abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "cut"), [("copter", "toward_zero"), ("plane", "down"), ("copter", "nearest")]
)
def test_a_flight_is_told_and_its_numbers_hold(vehicle, cut):
    effect = AccelerometerResolution(step=0.1, cut=cut)
    samples = simulated(vehicle, 150.0, seed=11, imu=IMU, effects=[effect])[0]
    found = answer(fed(samples), 1)
    # Cut downward by half a step or not at all, in this flight and in all others of the sensor.
    alike = 0.05 / np.sqrt(3.0)
    assert found.calibration.alike_sigma == pytest.approx([alike] * 3, rel=0.05)
    (told,) = [e for e in found.diagnosis.effects if e.name != "gps_latency"]
    assert told.name == "accelerometer_resolution"
    assert [q.value for q in told.unknowns.values()] == pytest.approx([0.1] * 3, rel=0.03)
    c = found.calibration
    sigma = np.array(c.scale_sigma + c.offset_sigma)
    assert np.max(np.abs(np.array(c.scale + c.offset) - SIX) / sigma) < 3.5
    assert c.status is Status.CALIBRATED
    # Whether it was cut downward, no flight tells: no offset is claimed to less.
    assert min(c.offset_sigma) > 0.1 / np.sqrt(12.0)
