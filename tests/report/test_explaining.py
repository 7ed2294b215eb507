"""Which accelerometers are read for a diagnosis: as few as give the same answer."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from onboard.core.calibrator import Calibrator
from onboard.core.diagnosis import diagnose
from onboard.core.settings import EstimatorSettings
from onboard.explain import LONGEST_FLIGHT_S, explain
from onboard.mavlink.dialect import MESSAGE_IDS
from onboard.replay import replay
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly

SPEC = FlightSpec(vehicle="copter", duration=60.0, imus=random_imus(4)[:1] * 2, seed=4)


@pytest.fixture(scope="module")
def frames():
    return fly(SPEC)


@pytest.fixture
def write(tmp_path, frames):
    def written(*left_out: str):
        numbers = {MESSAGE_IDS[name] for name in left_out}
        path = tmp_path / "flight.tlog"
        path.write_bytes(
            b"".join(
                struct.pack(">Q", at) + frame
                for at, frame in frames
                if int.from_bytes(frame[7:10], "little") not in numbers
            )
        )
        return path

    return written


def test_the_second_is_diagnosed_as_if_all_had_been_read(write):
    path = write()
    everything = Calibrator(EstimatorSettings(refine=False, buffer_s=LONGEST_FLIGHT_S))
    replay([path], everything)
    assert everything.imus == (1, 2)
    theirs, ours = diagnose(everything, 2), explain([path], imu=2)
    assert ours.imu == ours.diagnosis.imu == 2
    assert ours.diagnosis.verdict is theirs.verdict
    np.testing.assert_array_equal(ours.diagnosis.calibration.scale, theirs.calibration.scale)
    np.testing.assert_array_equal(ours.diagnosis.calibration.offset, theirs.calibration.offset)


def test_without_the_first_the_second_is_diagnosed(write):
    result = explain([write("RAW_IMU", "HIGHRES_IMU")])
    assert result.imu == 2
    assert np.isfinite(result.diagnosis.calibration.scale).all()
    assert result.document().recording.samples["imu"] > 0
