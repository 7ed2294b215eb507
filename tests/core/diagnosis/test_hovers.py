"""A hover: what it shows beyond chance is said, and nothing else."""

import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from onboard.core.estimate.result import Status
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec

STAMPED_EARLY = 0.02


def hovered(seed, late):
    gps = GpsTruth(delay=STAMPED_EARLY + late, stamped_early=STAMPED_EARLY)
    spec = FlightSpec(
        vehicle="copter", seed=seed, duration=100.0, imus=random_imus(seed), gps=gps, dull=True
    )
    return diagnose(heard(spec), 1)


@pytest.mark.slow
def test_a_receiver_that_is_late_shows_in_a_hover():
    found = hovered(7100, 0.4)
    late = {e.name: e for e in found.effects}["gps_latency"].unknowns["delay"]
    assert late.value == pytest.approx(0.4, abs=max(3.0 * late.sigma, 0.02))
    assert found.verdict is not Verdict.INSUFFICIENT
    assert found.calibration.status is Status.CALIBRATED


@pytest.mark.slow
def test_nothing_is_said_of_a_hover_that_shows_nothing():
    found = hovered(7102, 0.0)
    assert found.verdict is Verdict.INSUFFICIENT
    assert not found.effects
