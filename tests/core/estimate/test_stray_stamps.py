"""A stamp that no other one confirms moves no clock, and costs nothing but its own sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.events import Restarted
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.gps.distrust import WindowClosed
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, Vibration
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

ERRORS = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
KINDS = (ImuSample, AttitudeSample, GpsFix, Vibration)


@pytest.fixture(scope="module")
def flight():
    spec = FlightSpec(vehicle="copter", duration=90.0, imus=(ERRORS, ERRORS))
    decoder = Decoder(1, 1)
    return [s for _, message in fly_messages(spec) for s in decoder.decode(message)]


def learned(samples):
    calibrator, events = Calibrator(CalibratorSettings(refine=False)), []
    for sample in samples:
        events += calibrator.feed(sample)
    return calibrator, [*events, *calibrator.finish()]


def six(calibrator):
    c = calibrator.calibration(1)
    return np.array(c.scale + c.offset)


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("off", [3600.0, 30.0, -20.0, -3600.0])
def test_a_stray_stamp_of_any_stream_changes_nothing(flight, off, times):
    plain, expected = learned(flight)
    told, out = set(), []
    for sample in flight:
        kind = type(sample)
        if kind in KINDS and kind not in told and sample.t > 60.0:
            told.add(kind)
            out += [replace(sample, t=sample.t + off)] * times
        out.append(sample)
    assert told == set(KINDS)
    got, events = learned(out)
    assert not [e for e in events if isinstance(e, Restarted)]
    assert [e for e in events if isinstance(e, WindowClosed)] == [
        e for e in expected if isinstance(e, WindowClosed)
    ]
    assert np.array_equal(six(got), six(plain))


def test_vibration_goes_on_after_a_stray_stamp(flight):
    calibrator = Calibrator(CalibratorSettings(refine=False))
    odd = next(s for s in flight if isinstance(s, Vibration) and s.t > 60.0)
    for sample in flight:
        if sample is odd:
            calibrator.feed(replace(odd, t=odd.t + 3600.0))
        calibrator.feed(sample)
    tracks = calibrator._assembly.streams.slow_arrays(1)
    assert tracks["vibration"][0][-1] > flight[-1].t - 2.0


@pytest.mark.parametrize("outage", [8.0, 15.0, 300.0])
def test_after_an_outage_the_second_stamp_is_believed(flight, outage):
    """Nothing is lost of it but the samples of one instant."""
    later = [s for s in flight if s.t is not None]
    jump = [replace(s, t=s.t + outage) if s.t > 60.0 else s for s in later]
    calibrator, events = learned(jump)
    assert not [e for e in events if isinstance(e, Restarted)]
    ahead = calibrator.calibration(1).rejected.get("imu_ahead", 0)
    assert ahead == 0 if outage < 10.0 else 1 <= ahead <= 2
    assert calibrator._clock.newest == pytest.approx(flight[-1].t + outage, abs=1.0)


def test_a_reboot_is_told_with_the_second_round_of_samples(flight):
    stamped = [s for s in flight if isinstance(s, ImuSample)]
    calibrator = Calibrator(CalibratorSettings(refine=False))
    for sample in stamped:
        calibrator.feed(sample)
    rounds = sorted({s.t for s in stamped if s.imu == 1})
    for sample in stamped:
        assert sample.t <= rounds[1], "not told"
        if any(isinstance(e, Restarted) for e in calibrator.feed(sample)):
            break
    assert calibrator._clock.newest == sample.t
