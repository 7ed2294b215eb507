"""Streams that are slow or missing: what is said of them, and to do."""

from __future__ import annotations

import pytest

from onboard.answers.recorded import Recorded
from onboard.answers.replay import replay
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

TRUE = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))


def asked(folder, rate, seconds):
    spec = FlightSpec(
        vehicle="copter", duration=seconds, imus=(TRUE,), rates={"RAW_IMU": rate}, seed=11
    )
    write_tlog(spec, folder / "flight.tlog")
    return replay([folder / "flight.tlog"], Recorded()).answers[0].calibration


@pytest.mark.slow
def test_eight_samples_a_second_cost_sigmas_and_no_truth(tmp_path):
    given = asked(tmp_path, 8.0, 160.0)
    for value, true, sigma in zip(
        (*given.scale, *given.offset),
        (*TRUE.scale, *TRUE.offset),
        (*given.scale_sigma, *given.offset_sigma),
        strict=True,
    ):
        assert abs(value - true) < 4.0 * sigma
    assert max(given.scale_sigma) < 0.02  # a six-position calibration's: it has learned something


def test_fewer_are_said_to_be_too_few(tmp_path):
    given = asked(tmp_path, 3.0, 60.0)
    assert "fewer than 7.5 a second" in given.note
    assert "record it at 25 Hz or more" in given.coverage.advice


def test_without_flight_it_is_not_the_stream_that_is_blamed(tmp_path):
    spec = FlightSpec(vehicle="copter", duration=9.0, imus=(TRUE,), seed=11)
    write_tlog(spec, tmp_path / "flight.tlog")
    given = replay([tmp_path / "flight.tlog"], Recorded()).answers[0].calibration
    assert "a second" not in given.note


def test_without_a_receiver_it_is_the_receiver_that_is_missing(tmp_path):
    rates = {"GPS_RAW_INT": 0.0, "GLOBAL_POSITION_INT": 0.0}
    spec = FlightSpec(vehicle="copter", duration=30.0, imus=(TRUE,), rates=rates, seed=11)
    write_tlog(spec, tmp_path / "flight.tlog")
    given = replay([tmp_path / "flight.tlog"], Recorded()).answers[0].calibration
    assert given.note.endswith("no GPS")
