"""Standing adds nothing, takes nothing, and is not called flight."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Status
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.airborne import Ground, still
from onboard.core.inputs.samples import (
    AttitudeSample,
    GpsFix,
    ImuSample,
    ParameterValue,
    VehicleState,
)
from onboard.mavlink.decode import Decoder
from sitl.recording import FlightSpec, fly_messages

SHORT = CalibratorSettings(refine=False, buffer_s=100.0)
STAND_S = 300.0
"""Three times what is kept of a flight."""


@pytest.fixture(scope="module")
def flight():
    decoder, out = Decoder(1, 1), []
    for _, message in fly_messages(FlightSpec(vehicle="copter", duration=110.0)):
        out += decoder.decode(message)
    told = [s for s in out if isinstance(s, ParameterValue)]
    return told + [s for s in out if not isinstance(s, ParameterValue)]


def standing_on(flight, seconds):
    """What a vehicle sends that was left standing after it has landed."""
    timed = [s for s in flight if s.t is not None]
    end = max(s.t for s in timed)
    last = [s for s in timed if s.t > end - 10.0]
    return [replace(s, t=s.t + 10.0 * k) for k in range(1, int(seconds / 10.0) + 1) for s in last]


def fed(samples, settings=SHORT):
    calibrator = Calibrator(settings)
    for sample in samples:
        calibrator.feed(sample)
    calibrator.finish()
    return calibrator


@pytest.fixture(scope="module")
def before(flight):
    """Fed with the flight; only to be looked at."""
    return fed(flight)


def without_states(samples):
    return [s for s in samples if not isinstance(s, VehicleState)]


@pytest.mark.slow
@pytest.mark.parametrize("told", [True, False])
def test_a_long_stand_after_the_landing_changes_nothing(flight, before, told):
    samples = flight if told else without_states(flight)
    stand = standing_on(flight, STAND_S)
    after = fed([*samples, *(stand if told else without_states(stand))])
    landed = before if told else fed(samples)
    one, two = landed.calibration(1), after.calibration(1)
    assert two.status is one.status is Status.CALIBRATED
    assert (two.scale, two.offset) == (one.scale, one.offset)
    assert two.covariance == one.covariance
    assert two.trusted_s == one.trusted_s
    assert "hovering" not in two.note


@pytest.mark.slow
def test_ten_seconds_of_being_armed_on_the_ground_are_no_flight(flight, before):
    stand = standing_on(flight, 60.0)
    begin = stand[0].t
    armed = [
        replace(s, armed=begin + 20.0 < s.t < begin + 30.0)
        if isinstance(s, VehicleState) and s.armed is not None
        else s
        for s in stand
    ]
    landed, after = before.calibration(1), fed([*flight, *armed]).calibration(1)
    assert after.trusted_s == landed.trusted_s
    assert after.covariance == landed.covariance


def test_a_hover_after_the_brisk_part_does_not_undo_it(flight, before):
    """The buffer slides past the brisk part; that it was flown stays known."""
    engine = fed(flight, replace(SHORT, buffer_s=20.0)).engine(1)
    assert engine.left_brisk_s > 20.0
    assert engine.moving
    assert engine.brisk_s == pytest.approx(before.engine(1).brisk_s)


def test_that_it_moved_is_known_after_a_restart(flight):
    named = [ParameterValue("INS_ACC_ID", 5.0), *flight]
    once = fed(named)
    resumed = Calibrator.from_bytes(once.to_bytes(), SHORT)
    for sample in named:
        resumed.feed(sample)
    resumed.finish()
    assert resumed.calibration(1).rejected["restored"] == 1
    assert resumed.engine(1).brisk_s == pytest.approx(2.0 * once.engine(1).brisk_s)


@pytest.mark.slow
def test_the_frozen_flight_stays_while_the_live_one_goes_on(flight):
    live = Calibrator(SHORT)
    for sample in flight:
        live.feed(sample)
    frozen = live.frozen()
    then = frozen.calibration(1), len(frozen.engine(1).batches)
    again = [replace(s, t=s.t + 200.0) for s in flight if s.t is not None]
    for sample in again:
        live.feed(sample)
    assert live.engine(1).trusted_s > 1.5 * then[0].trusted_s
    assert (frozen.calibration(1), len(frozen.engine(1).batches)) == then


@pytest.mark.parametrize(
    ("armed", "landed", "grounded"),
    [
        (False, None, True),
        (False, False, True),
        (True, True, True),
        (True, False, False),
        (None, True, True),
        (None, False, False),
        (True, None, None),
        (None, None, None),
    ],
)
def test_the_autopilots_word_decides_where_there_is_one(armed, landed, grounded):
    ground = Ground()
    ground.feed(VehicleState(1.0, armed, landed))
    assert ground.grounded is grounded


def test_stillness_needs_both_speed_and_rates_to_be_small():
    rng = np.random.default_rng(1)
    at_rest, rocking = rng.normal(0.0, 0.05, (50, 3)), rng.normal(0.0, 0.005, (500, 3))
    assert still(at_rest, rocking + 0.1), "a gyroscope's bias is no motion"
    assert not still(at_rest, 10.0 * rocking)
    assert not still(at_rest + 2.0, rocking)
    assert not still(np.zeros((0, 3)), rocking)


def kinds(samples):
    return {type(s) for s in samples}


def test_the_stand_is_one(flight):
    assert {ImuSample, AttitudeSample, GpsFix, VehicleState} <= kinds(standing_on(flight, 20.0))
