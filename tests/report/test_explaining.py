"""Which accelerometers are read for a diagnosis: as few as give the same answer."""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.explain import explain
from onboard.answers.recorded import Recorded
from onboard.answers.replay import read
from onboard.mavlink.dialect import MESSAGE_IDS
from sitl.builtin.effects import GpsFault
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly, write_tlog

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


@pytest.mark.slow
def test_the_second_is_diagnosed_as_if_all_had_been_read(write):
    path = write()
    everything = Recorded()
    read([path], everything)
    assert everything.imus == (1, 2)
    theirs, ours = everything.answer(2).diagnosis, explain([path], imu=2)
    assert ours.imu == ours.diagnosis.imu == 2
    assert ours.diagnosis.verdict is theirs.verdict
    np.testing.assert_array_equal(ours.diagnosis.calibration.scale, theirs.calibration.scale)
    np.testing.assert_array_equal(ours.diagnosis.calibration.offset, theirs.calibration.offset)


@pytest.mark.slow
def test_without_the_first_the_second_is_diagnosed(write):
    result = explain([write("RAW_IMU", "HIGHRES_IMU")])
    assert result.imu == 2
    assert np.isfinite(result.diagnosis.calibration.scale).all()
    assert result.document().recording.samples["imu"] > 0


@pytest.mark.slow
def test_a_second_recording_follows_on_the_first(tmp_path):
    """Both clocks begin at the same time: a fault of the second must not spoil the first."""
    quiet = FlightSpec(vehicle="plane", duration=100.0, imus=random_imus(4)[:1], seed=4)
    fault = GpsFault(start=60.0, end=75.0, north=6.0, east=-4.0)
    paths = [tmp_path / "one.tlog", tmp_path / "two.tlog"]
    write_tlog(quiet, paths[0])
    write_tlog(replace(quiet, seed=5, effects=(fault,)), paths[1])
    d = explain(paths).diagnosis
    (found,) = (e for e in d.effects if e.name == "gps_fault")
    begins = d.series.t[np.argmax(np.diff(d.series.t)) + 1]
    assert begins > 95.0
    assert np.all(np.diff(d.series.t) > 0.0)
    assert min(a for a, _ in found.intervals) > begins + 30.0
    assert max(b for _, b in found.intervals) < begins + 90.0
