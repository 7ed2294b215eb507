"""A log stamps a fix when it is written, telemetry when it came: one flight, one answer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import GpsFix, ImuSample
from onboard.mavlink.decode import Decoder
from onboard.recordings.opening import open_recording
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec, fly_messages
from tests.recordings.dataflash_writer import modern_log
from tests.recordings.simulated_log import logged


def diagnosed(samples):
    made = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0))
    for sample in samples:
        made.feed(sample)
    made.finish()
    return diagnose(made, 1)


def flown(duration, delay):
    gps = GpsTruth(delay=delay, stamped_early=0.02)
    imus = random_imus(83)
    spec = FlightSpec(vehicle="plane", seed=83, duration=duration, imus=imus, gps=gps)
    decoder = Decoder(1, 1)
    return [s for _, message in fly_messages(spec) for s in decoder.decode(message)]


def fixes_of(log, folder: Path) -> list[GpsFix]:
    path = folder / "log.BIN"
    path.write_bytes(bytes(log))
    return [s for s in open_recording(path).samples() if isinstance(s, GpsFix)]


def test_the_stamp_of_a_fix_does_not_wait_for_the_log(tmp_path):
    samples = [
        s
        for k in range(200)
        for s in (
            ImuSample(5.0 + 0.04 * k, 1, (0.0, 0.0, -9.8), (0.0, 0.0, 0.1)),
            GpsFix(5.0 + 0.04 * k, 1, 3, 0.5, 0.5, 10.0, 3.0, 4.0),
        )
    ]
    found = fixes_of(logged(samples, lambda t: 0.017 if t < 9.0 else 0.033), tmp_path)
    assert np.diff([f.t for f in found]) == pytest.approx(0.04, abs=1e-5)
    assert np.mean([f.t - s.t for f, s in zip(found, samples[1::2], strict=True)]) == pytest.approx(
        0.025, abs=1e-3
    )
    assert [f.t_message for f in found] == pytest.approx([s.t for s in samples[1::2]], abs=1e-3)


def test_a_layout_without_the_time_of_the_message_keeps_its_own_stamp(tmp_path):
    log = modern_log()
    (kind, letters) = log.kinds["GPA"]
    with_time = fixes_of(log, tmp_path)
    columns = b"TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS"
    assert columns in log.data
    log.data = log.data.replace(columns, columns[:-3] + b"XXX")
    assert (kind, letters) == log.kinds["GPA"]
    without = fixes_of(log, tmp_path)
    assert [f.t_message for f in without] == [None] * len(without)
    assert [f.t for f in without] == pytest.approx([f.t for f in with_time], abs=1e-3)


@pytest.mark.slow
def test_a_log_that_is_written_later_and_later_is_as_clean_as_its_telemetry(tmp_path):
    # ArduPilot's wait for the log moved from 17 to 33 ms in a real one; as a clock that runs off
    # it was explained by physics that was not there.
    path = tmp_path / "flight.BIN"
    flight = flown(250.0, 0.05)
    path.write_bytes(bytes(logged(flight, lambda t: 0.017 if t < 125.0 else 0.047)))
    said = diagnosed(open_recording(path).samples())
    assert [e.name for e in said.effects] == []
    assert said.verdict is Verdict.CLEAN


@pytest.mark.slow
def test_log_and_telemetry_of_one_flight_advise_one_latency(tmp_path):
    path = tmp_path / "flight.BIN"
    flight = flown(150.0, 0.19)
    path.write_bytes(bytes(logged(flight, lambda t: 0.032)))
    link, log = diagnosed(flight), diagnosed(open_recording(path).samples())
    assert link.verdict is log.verdict is Verdict.EXPLAINED
    (by_link,), (by_log,) = link.effects, log.effects
    assert by_link.name == by_log.name == "gps_latency"
    one, other = by_link.unknowns["delay"], by_log.unknowns["delay"]
    rounding = 1.0
    sigma = 1e3 * np.hypot(one.sigma, other.sigma)
    advice = by_link.parameters["GPS1_DELAY_MS"], by_log.parameters["GPS1_DELAY_MS"]
    assert abs(advice[0] - advice[1]) < rounding + 3.0 * sigma
    assert advice[0] == pytest.approx(170.0, abs=rounding + 3e3 * one.sigma)
    # The unknown itself is against the recording's own stamp.
    assert other.value - one.value == pytest.approx(0.032, abs=3e-3 * sigma)
