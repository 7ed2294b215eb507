"""A crooked gyroscope must not pass for an accelerometer's offset where the vehicle has another."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.gyroscopes import rates_at
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ImuSample, ImuSource, ParameterValue
from onboard.core.inputs.tracks import ImuTrack
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.frames import rotation_from_vector
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

TILT = 0.02
CROOKED = rotation_from_vector(np.array([TILT, 0.0, 0.0])) @ np.diag([1.02, 1.03, 0.98])
ONE_CHIP = 2 | 4 << 3 | 1 << 8
OTHER = 2 | 4 << 3 | 3 << 8


@pytest.fixture(scope="module")
def flight():
    truth = ImuTruth(scale=(1.01, 0.99, 1.005), offset=(0.1, -0.2, 0.15))
    decoder = Decoder()
    spec = FlightSpec(vehicle="copter", seed=3, duration=75.0, imus=(truth,))
    samples = [s for _, m in fly_messages(spec) for s in decoder.decode(m)]
    # The vehicle's own word on a second IMU that it does not have would contradict the twin.
    others = ("INS_ACC2", "INS_GYR2")
    return [s for s in samples if not (isinstance(s, ParameterValue) and s.name.startswith(others))]


def twin(sample):
    """A second IMU: the same accelerometer, with a gyroscope that is soldered at an angle."""
    return replace(sample, imu=2, w_b=tuple(CROOKED @ np.array(sample.w_b)))


def calibrated(samples, *, second=False, ids=(), settings=None):
    made = Calibrator(settings)
    for name, value in ids:
        made.feed(ParameterValue(name, float(value)))
    for sample in samples:
        made.feed(sample)
        if second and isinstance(sample, ImuSample):
            made.feed(twin(sample))
        if second and isinstance(sample, ParameterValue):
            for own, other in zip(parameter_names(1).six, parameter_names(2).six, strict=True):
                if sample.name == own:
                    made.feed(replace(sample, name=other))
    made.finish()
    return made


def six(made, imu):
    c = made.calibration(imu)
    return np.array(c.scale + c.offset)


@pytest.mark.slow
@pytest.mark.parametrize("refine", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_accelerometers_share_the_gyroscope_of_the_first_and_the_first_does_not_notice(
    flight, refine
):
    settings = CalibratorSettings(refine=refine)
    alone = calibrated(flight, settings=settings)
    both = calibrated(flight, second=True, settings=settings)
    assert both.imus == (1, 2)
    np.testing.assert_array_equal(six(both, 1), six(alone, 1))
    # Its own gyroscope would put TILT of gravity into y.  Only interpolation is left.
    np.testing.assert_allclose(six(both, 2), six(both, 1), rtol=0.0, atol=1e-6)


@pytest.mark.slow
def test_a_gyroscope_of_the_same_chip_is_the_accelerometers_own(flight):
    ids = [("INS_ACC2_ID", ONE_CHIP | 22 << 16), ("INS_GYR2_ID", ONE_CHIP | 36 << 16)]
    made = calibrated(flight, second=True, ids=ids, settings=CalibratorSettings(refine=False))
    w = [made.engine(imu).batches[2].segment.w_b for imu in (1, 2)]
    # Both streams are cut to whole mrad/s, in axes of their own.
    np.testing.assert_allclose(w[1], w[0] @ CROOKED.T, rtol=0.0, atol=1.1e-3)
    assert np.abs(w[1] - w[0]).max() > 0.01


@pytest.mark.parametrize(
    ("accelerometer", "gyroscope", "one"),
    [
        (ONE_CHIP | 22 << 16, ONE_CHIP | 36 << 16, True),
        (ONE_CHIP | 22 << 16, OTHER | 36 << 16, False),
        (0, 0, False),
        (None, None, False),
    ],
)
def test_device_ids_tell_whether_both_are_one_chip(accelerometer, gyroscope, one):
    parameters = ParametersInForce()
    for name, value in (("INS_ACC2_ID", accelerometer), ("INS_GYR2_ID", gyroscope)):
        if value is not None:
            parameters.set(name, float(value))
    assert parameters.one_chip(2) is one
    assert not parameters.one_chip(1)


def track(times):
    made = ImuTrack()
    for t in times:
        sample = ImuSample(
            t=t,
            imu=1,
            f_b=(0.0, 0.0, -9.8),
            w_b=(np.sin(t), np.cos(t), 0.1 * t),
            source=ImuSource.LOG,
        )
        assert made.add(sample, SixParameters(), None)
    return made


def test_rates_are_those_at_the_other_sensors_times():
    at = np.arange(1.0, 3.0, 0.02) + 0.007
    w = rates_at(track(np.arange(0.0, 4.0, 0.02)), at, 0.25)
    np.testing.assert_allclose(w, np.column_stack([np.sin(at), np.cos(at), 0.1 * at]), atol=1e-6)


@pytest.mark.parametrize(
    "times",
    [
        np.arange(0.0, 4.0, 0.05),  # too sparse
        np.concatenate([np.arange(0.0, 1.5, 0.02), np.arange(2.0, 4.0, 0.02)]),  # a gap
        np.arange(0.0, 2.0, 0.02),  # ends early
        np.arange(2.0, 4.0, 0.02),  # begins late
        np.array([0.0, 0.02]),
    ],
)
def test_rates_that_do_not_cover_the_flight_are_not_used(times):
    assert rates_at(track(times), np.arange(1.0, 3.0, 0.02), 0.25) is None


@pytest.mark.slow
def test_a_gyroscope_that_repeats_one_reading_carries_nobody(flight):
    """The first IMU dies in flight with its last readings: the second is calibrated as it was."""
    times = [s.t for s in flight if isinstance(s, ImuSample)]
    died, last = 0.5 * (times[0] + times[-1]), {}

    def dead(sample):
        if not isinstance(sample, ImuSample) or sample.t < died:
            return sample
        kept = last.setdefault("reading", sample)
        return replace(sample, f_b=kept.f_b, w_b=kept.w_b)

    def both(change):
        made = Calibrator()
        for sample in flight:
            made.feed(change(sample))
            if isinstance(sample, ImuSample):
                made.feed(replace(sample, imu=2))
        made.finish()
        return made.calibration(2)

    whole, without = both(lambda sample: sample), both(dead)
    sigma = np.array(without.scale_sigma)
    assert np.all(np.abs(np.subtract(without.scale, whole.scale)) < 2.0 * sigma)
    assert np.all(sigma < 1.6 * np.array(whole.scale_sigma))
    assert without.trusted_s == pytest.approx(whole.trusted_s, abs=6.0)
