from __future__ import annotations

import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.range_checks import impossible, measured
from onboard.core.inputs.samples import (
    AttitudeSample,
    GpsFix,
    ImuSample,
    ParameterValue,
    Vibration,
)

IMU = ImuSample(10.0, 1, (0.1, 0.2, -9.8), (0.01, 0.02, 0.03), 25.0)
ATTITUDE = AttitudeSample(10.0, 0.1, -0.2, 3.0)
FIX = GpsFix(10.0, 1, 3, 0.5, 1.0, 500.0, 3.0, -4.0, 0.5)
SCALE = ParameterValue("INS_ACCSCAL_X", 1.01)
VIBE = Vibration(10.0, (1.0, 1.0, 1.0))
HUGE = (math.nan, math.inf, -math.inf, 1e38, -1e300)


@pytest.mark.parametrize(
    "sample",
    [
        IMU,
        replace(IMU, w_b=None),
        replace(IMU, f_b=(0.0, 300.0, 0.0)),
        ATTITUDE,
        replace(ATTITUDE, yaw=2.0 * math.pi),
        FIX,
        replace(FIX, v_d=None),
        replace(FIX, altitude=-400.0),
        SCALE,
        replace(SCALE, name="BRD_SERIAL_NUM", value=2.1e9),
        replace(SCALE, name="COMPASS_OFFS_MAX", value=1800.0),
        VIBE,
    ],
)
def test_what_flies_passes(sample):
    assert impossible(sample) is None


@pytest.mark.parametrize("x", HUGE)
def test_what_no_sensor_measures_is_refused_by_name(x):
    for k in range(3):
        three = tuple(x if i == k else 0.1 for i in range(3))
        assert impossible(replace(IMU, f_b=three)) == "imu_impossible"
        assert impossible(replace(IMU, w_b=three)) == "imu_impossible"
    for field in ("roll", "pitch", "yaw"):
        assert impossible(replace(ATTITUDE, **{field: x})) == "attitude_impossible"
    for field in ("v_n", "v_e", "v_d", "altitude"):
        assert impossible(replace(FIX, **{field: x})) == "gps_impossible"
    for sample in (IMU, ATTITUDE, FIX, VIBE):
        assert impossible(replace(sample, t=x)) is not None
    assert impossible(replace(SCALE, value=x)) == "parameter_impossible"
    assert impossible(replace(SCALE, value=20.0)) == "parameter_impossible"
    for name in ("GPS1_POS_X", "GPS_POS1_Y", "INS_POS2_Z"):
        assert impossible(replace(SCALE, name=name, value=x)) == "parameter_impossible"
        assert impossible(replace(SCALE, name=name, value=-2000.0)) == "parameter_impossible"
        assert impossible(replace(SCALE, name=name, value=-12.0)) is None


def test_a_receiver_without_vertical_velocity_is_believed_horizontally():
    assert measured(replace(FIX, v_d=math.nan)) == replace(FIX, v_d=None)
    for sample in (IMU, ATTITUDE, FIX, replace(FIX, v_d=None)):
        assert measured(sample) is sample


@pytest.mark.parametrize("imu", [0, -1, 6, 200])
def test_accelerometers_that_autopilots_do_not_have(imu):
    assert impossible(replace(IMU, imu=imu)) == "imu_impossible"


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 999), st.integers(0, 9), st.integers(0, 63)),
        min_size=1,
        max_size=40,
    )
)
def test_flipped_bits_never_stop_the_calibrator(flips):
    """Forty seconds of turning flight, some doubles with one bit wrong: counted, not raised."""
    where = {(n, field): bit for n, field, bit in flips}
    calibrator = Calibrator()
    for n in range(1000):
        t = n * 0.04
        values = [t, 3.0 * math.sin(t), 0.2 * math.cos(t), -9.8 - math.sin(0.5 * t)]
        values += [0.1 * math.cos(t), 0.05, 0.3, 0.1 * math.sin(t), 0.02, 0.3 * t % math.tau]
        for field in range(10):
            if (n, field) in where:
                values[field] = flipped(values[field], where[n, field])
        calibrator.feed(ImuSample(values[0], 1, tuple(values[1:4]), tuple(values[4:7])))
        calibrator.feed(AttitudeSample(values[0], *values[7:10]))
        if n % 5 == 0:
            speed = (values[1], values[2], 0.1)
            calibrator.feed(GpsFix(values[0], 1, 3, 0.6, 0.1, 500.0, *speed))
    calibrator.finish()
    for imu in calibrator.imus:
        calibrator.calibration(imu)


def flipped(value: float, bit: int) -> float:
    """The double with one bit inverted."""
    (number,) = struct.unpack("<Q", struct.pack("<d", value))
    (other,) = struct.unpack("<d", struct.pack("<Q", number ^ (1 << bit)))
    return other
