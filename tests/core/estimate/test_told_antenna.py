"""The antenna is in one place, whatever the autopilot is told of it, and whenever."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibration_model import antenna_of
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import GpsFix, ParameterValue
from onboard.core.maths.blocks import total
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.recording import FlightSpec, fly_messages

SCALE, OFFSET = (1.02, 0.985, 1.015), (0.2, -0.15, 0.3)
PLACE = np.array([0.7, 0.0, -0.4])
END = 1e9


@pytest.fixture(scope="module")
def flight():
    """Samples of a flight with the antenna away from the IMU; parameters come first."""
    spec = FlightSpec(
        vehicle="copter",
        duration=100.0,
        imus=(ImuTruth(scale=SCALE, offset=OFFSET),),
        gps=GpsTruth(antenna=tuple(PLACE)),
        loop_rate=200,
    )
    decoder = Decoder(1, 1)
    out = [s for _, message in fly_messages(spec) for s in decoder.decode(message)]
    told = [s for s in out if isinstance(s, ParameterValue) and "POS" not in s.name]
    return told + [s for s in out if not isinstance(s, ParameterValue)]


def flown(samples, told_at, settings=None):
    """A calibrator whose autopilot is told of the place at a time, s."""
    calibrator = Calibrator(settings)
    waiting = [ParameterValue(f"GPS1_POS_{a}", x) for a, x in zip("XYZ", PLACE, strict=True)]
    for sample in samples:
        if waiting and isinstance(sample, GpsFix) and sample.t >= told_at:
            for parameter in waiting:
                calibrator.feed(parameter)
            waiting = []
        calibrator.feed(sample)
    calibrator.finish()
    for parameter in waiting:
        calibrator.feed(parameter)
    return calibrator


def place(engine):
    """(3,) where the antenna is from the IMU."""
    return engine.told + engine.solution().theta[antenna_of(engine.model)]


@pytest.mark.parametrize("told_at", [50.0, END])
def test_it_does_not_matter_when_a_place_is_told(flight, told_at):
    first, late = flown(flight, 0.0), flown(flight, told_at)
    if told_at == END:  # refined before it was told: with the prior about no place
        late.engine(1).refine()
    a, b = first.calibration(1), late.calibration(1)
    sigma = np.array(a.scale_sigma + a.offset_sigma)
    off = np.array(b.scale + b.offset) - np.array(a.scale + a.offset)
    assert np.all(np.abs(off) < 0.3 * sigma)
    assert np.array(b.scale_sigma + b.offset_sigma) == pytest.approx(sigma, rel=0.2)
    for calibrator in (first, late):
        assert place(calibrator.engine(1)) == pytest.approx(PLACE, abs=0.03)


def test_sums_of_flight_that_is_gone_count_from_there_too(flight):
    """A place told there and back leaves sums, point and flight as they were."""
    engine = flown(flight, END, CalibratorSettings(refine=False)).engine(1)
    before, point, at = total(engine.all_blocks), engine.point, place(engine)
    engine.tell_antenna(engine.told + np.array([0.3, -0.2, 0.1]))
    assert np.any(total(engine.all_blocks).b != before.b)
    moved = engine.solution()
    engine.tell_antenna(engine.told - np.array([0.3, -0.2, 0.1]))
    after = total(engine.all_blocks)
    np.testing.assert_allclose(after.b, before.b, rtol=1e-7, atol=1e-7 * np.abs(before.b).max())
    np.testing.assert_allclose(after.N, before.N)
    assert engine.point.antenna == pytest.approx(point.antenna)
    assert place(engine) == pytest.approx(at, abs=1e-6)
    # Only the prior is about another place.
    data = moved.information[antenna_of(engine.model), antenna_of(engine.model)]
    assert np.all(np.isfinite(data))


def test_what_was_saved_counts_from_its_own_place(flight):
    engine = flown(flight, END, CalibratorSettings(refine=False)).engine(1)
    saved, told = engine.all_blocks, np.zeros(3)
    engine.tell_antenna(told)
    blocks = [b.sums for b in saved]
    engine.told = told.copy()
    same = engine.brought(saved, engine.point, told)
    assert all(np.array_equal(a.sums.b, b.b) for a, b in zip(same, blocks, strict=True))
    there = engine.brought(saved, engine.point, told - PLACE)
    shift = np.zeros(engine.model.size)
    shift[antenna_of(engine.model)] = PLACE
    for a, b in zip(there, blocks, strict=True):
        np.testing.assert_allclose(a.sums.b, b.b - b.N @ shift)


def test_an_accelerometer_that_is_only_beside_counts_from_there_as_well(flight):
    """What two of one vehicle feel is compared by where they are from the antenna."""
    both = []
    for sample in flight:
        both.append(sample)
        if hasattr(sample, "imu") and hasattr(sample, "f_b"):
            both.append(replace(sample, imu=2))
    calibrator = Calibrator(CalibratorSettings(refine=False, at_once=False), only=(1,))
    for sample in both:
        calibrator.feed(sample)
    calibrator.finish()
    calibrator.feed(ParameterValue("GPS1_POS_X", 0.5))
    calibrator.feed(ParameterValue("INS_POS2_X", 0.1))
    one, two = calibrator.flown[1], calibrator.flown[2]
    assert {tuple(b.segment.lever_arm_b) for b in one} == {(0.5, 0.0, 0.0)}
    assert {tuple(b.segment.lever_arm_b) for b in two} == {(0.4, 0.0, 0.0)}
