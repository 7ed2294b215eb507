"""A receiver that the autopilot's filter gave up, and an accelerometer that no model describes."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import explaining
from onboard.answers.answer import answer
from onboard.core.diagnosis.given_up import GivenUp
from onboard.core.diagnosis.records import Verdict
from onboard.core.diagnosis.refusals import OPINIONS
from onboard.core.diagnosis.screening import heard
from onboard.core.estimate.result import Status
from onboard.core.gps.distrust import Distrust, RefusedFixes
from sitl.builtin.effects.accelerometer import ByAxis
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec
from tests.core.diagnosis.flights import batches


@dataclass(frozen=True, slots=True, kw_only=True)
class Loose(ByAxis):
    """An accelerometer that has come off from ``time`` to ``end`` (s), and swings as it likes."""

    name = "bias_step"
    time: float = 90.0
    end: float = 1e9

    def reads_too_much(self, scene):
        """(n, 3) m/s^2."""
        t = scene.elapsed - self.time
        swings = np.sin(2.0 * np.pi * t / 7.0) + 0.7 * np.sin(2.0 * np.pi * t / 3.1)
        return np.outer(np.where((t > 0.0) & (scene.elapsed < self.end), swings, 0.0), self.sizes)


def flown(seed, loose):
    imus = random_imus(seed)
    spec = FlightSpec(vehicle="plane", seed=seed, duration=180.0, imus=imus, effects=(loose,))
    given = answer(explaining.heard(spec), 1)
    c, truth = given.diagnosis.calibration, imus[0]
    off = np.subtract(c.scale + c.offset, truth.scale + truth.offset)
    assert np.all(np.abs(off) < 4.0 * np.array(c.scale_sigma + c.offset_sigma))
    return given


@pytest.mark.slow
def test_an_accelerometer_that_came_off_for_good_is_not_calibrated():
    given = flown(41, Loose(x=3.0))
    said = given.diagnosis
    assert said.verdict is Verdict.PARTLY_EXPLAINED
    assert said.calibration.status is Status.INSUFFICIENT
    assert given.missing.startswith("from 90 s on GPS is far from this accelerometer")
    (unused,) = said.unused
    assert (unused.reason, unused.contradicted) == ("ekf_gps_glitch", True)


@pytest.mark.slow
def test_what_agrees_again_before_the_flight_ends_is_what_it_was():
    said = flown(43, Loose(x=3.0, z=2.0, end=120.0)).diagnosis
    assert said.calibration.status is Status.CALIBRATED
    (unused,) = said.unused
    assert unused.contradicted
    assert not said.inconstant


@pytest.mark.parametrize("reason", sorted(OPINIONS))
def test_only_a_filter_that_leans_on_the_accelerometers_is_no_witness_against_the_receiver(reason):
    flight = batches(np.zeros((3000, 3)), t0=100.0)
    for b in flight:
        b.trusted[(b.fixes.t >= 120.0) & (b.fixes.t <= 150.0)] = False
    refusals = (RefusedFixes(120.0, 150.0, reason),)
    listened = SimpleNamespace(trust=SimpleNamespace(refusals=refusals))
    given_up = GivenUp(listened, SimpleNamespace(sampled=flight), 100.0)
    by_the_filter = reason in {Distrust.EKF_GPS_GLITCH, Distrust.EKF_UNHEALTHY}
    assert bool(given_up) == by_the_filter
    believed = np.concatenate([b.trusted for b in heard(flight, given_up.stretches)])
    assert believed.all() == by_the_filter
