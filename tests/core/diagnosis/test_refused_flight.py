"""What the trust window refused in flight: when, why, and what the inertia says of it."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.verdict import headline, unused_in_words
from onboard.core.diagnosis.records import Mismatch, Verdict
from onboard.core.estimate.gps_clock import FixClock
from onboard.core.estimate.result import Status
from onboard.core.gps.distrust import Distrust
from onboard.core.gps.trust import EKF_ATTITUDE, EKF_GPS_GLITCHING, TrustWindow
from onboard.core.inputs.samples import EkfHealth, GpsFix
from onboard.core.physics.effects.gps_latency import GpsLatency
from sitl.builtin import effects as concealed
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.recording import FlightSpec
from tests.core.diagnosis.complaints import PROMPT, complained

NOISY = GpsTruth(delay=0.04, stamped_early=0.02, velocity_noise=0.15, velocity_coloured=0.15)


def flagged(seed, gps, complaints, *effects, duration=140.0):
    """Diagnosed with an EKF that complains of GPS from and to the times of ``complaints``, s."""
    spec = FlightSpec(
        vehicle="copter",
        seed=seed,
        duration=duration,
        imus=random_imus(seed),
        gps=gps,
        effects=effects,
    )
    return complained(spec, complaints)


@pytest.mark.slow
def test_a_long_false_velocity_that_the_ekf_refused_is_no_clean_flight():
    fault = concealed.GpsFault(start=60.0, end=93.0, north=1.2, east=-0.9)
    # After half a minute of coasting such a fault is five of its sigmas: seen in two of three.
    said, first = flagged(71, NOISY, [(61.0, 98.0)], fault)
    assert said.verdict is Verdict.EXPLAINED
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert begin + first == pytest.approx(fault.start, abs=1.5)
    assert end + first == pytest.approx(fault.end, abs=1.5)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(1.5, abs=3.0 * offset.sigma)
    assert offset.sigma < 0.5
    (unused,) = said.unused
    assert (unused.reason, unused.contradicted) == ("ekf_gps_glitch", True)


@pytest.mark.slow
def test_a_fault_that_was_believed_in_its_middle_is_no_jump_and_ends_when_the_receiver_is_right():
    """What others doubted is true if the accelerometer has jumped: so it is asked, too."""
    fault = concealed.GpsFault(start=60.0, end=77.5, north=1.6, east=-1.55)
    said, first = flagged(72, PROMPT, [(60.3, 67.7), (70.9, 84.7)], fault, duration=128.0)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((fault.start, fault.end), abs=1.0)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(float(np.hypot(1.6, 1.55)), abs=3.0 * offset.sigma)


@pytest.mark.slow
def test_a_complaint_that_nothing_bears_out_is_said_and_the_flight_is_not_bare_clean():
    said, first = flagged(41, PROMPT, [(60.0, 75.0)], duration=110.0)
    assert said.verdict is Verdict.CLEAN
    (unused,) = said.unused
    assert unused.start_s + first == pytest.approx(60.0, abs=1.0)
    assert unused.contradicted is False
    assert "where GPS was believed" in headline(said)
    (sentence,) = unused_in_words(said)
    assert "the autopilot reports a GPS glitch" in sentence
    assert "nothing there contradicts GPS" in sentence


def test_the_window_remembers_when_it_refused_and_why():
    window = TrustWindow()
    for k in range(100):
        t = 0.2 * k
        if k % 5 == 0:
            bad = 5.0 <= t < 8.0
            window.feed(EkfHealth(t, EKF_ATTITUDE | (EKF_GPS_GLITCHING if bad else 0)))
        window.feed(GpsFix(t, 1, 3, 0.5, 0.5, 10.0, 0.0, 0.0, satellites=12))
    (refusal,) = window.refusals
    assert refusal.reason is Distrust.EKF_GPS_GLITCH
    # Until the recovery time of five seconds has passed.
    assert (refusal.start, refusal.end) == pytest.approx((5.0, 12.8), abs=0.21)


def test_a_proof_on_less_than_half_of_the_fixes_supports_nothing():
    nan = float("nan")
    made = Mismatch(
        detected=True,
        whitened_rms_before=1.0,
        whitened_rms_after=1.0,
        p_value=0.0,
        velocity_rms_before=nan,
        velocity_rms_after=nan,
        held_out_before=nan,
        held_out_after=nan,
        fixes=7,
        believed=742,
    )
    assert not made.supported
    most = replace(made, fixes=371)
    assert most.supported
    # Nor of one whose attitude leaps at more than half of its fixes.
    assert replace(most, leaps=185).supported
    assert not replace(most, leaps=186).supported


@pytest.mark.slow
@pytest.mark.recordings
def test_a_flight_with_a_failing_receiver_is_never_explained(recordings):
    """From 112 s on it cannot be true what is recorded.

    To 132 s the copter holds 52 to 55 degrees of roll while the velocity that is reported goes to
    and fro by 10 m/s; from 124.8 to 131.0, 132.6 to 142 and 162 to 171 s that velocity differs by
    2 to 20 m/s from the rate of change of the same receiver's position, and until 142.8 s it comes
    back by 6 m/s in 0.6 s.
    """
    from onboard.answers.explain import explain  # noqa: PLC0415 - not needed without the recordings

    said = explain([recordings / "real" / "real-quad-12-gpsglitch.BIN"]).diagnosis
    assert said.verdict in {Verdict.INSUFFICIENT, Verdict.PARTLY_EXPLAINED}
    assert said.calibration.status is not Status.CALIBRATED
    if not said.mismatch.supported:
        assert f"only {said.mismatch.fixes} of {said.mismatch.believed} GPS fixes" in said.note
        return
    (fault,) = (e for e in said.effects if e.name == "gps_fault")
    # What else is said may be of timing, of receiver or attitude, which an EKF that follows a false
    # velocity disturbs: no error of the sensor.
    timing = ("gps_", "clock_", "imu_delay")
    assert all(e.name.startswith(timing) for e in said.effects)
    failing = [(112.0, 142.8), (162.0, 171.0)]
    for a, b in fault.intervals:
        assert any(start - 1.0 <= a <= b <= end + 1.0 for start, end in failing), (a, b)


def advised(delay, clock):
    cure = GpsLatency._cured_by(delay, clock)
    return cure.words, cure.parameters


def test_the_advice_counts_from_the_ekfs_own_stamp():
    clock = FixClock(late=0.032, assumed=(0.12, 0.22))
    cure, parameters = advised(0.214, clock)
    assert parameters == {"GPS1_DELAY_MS": 182.0}
    assert "32 ms later" in cure
    assert "120 or 220 ms" in cure


def test_what_the_driver_assumes_by_itself_is_not_advised():
    cure, parameters = advised(0.19, FixClock(assumed=(0.2,)))
    assert parameters == {}
    assert cure.startswith("none")
    _, parameters = advised(0.19, FixClock(configured=0.1, assumed=(0.1,)))
    assert parameters == {"GPS1_DELAY_MS": 190.0}


@pytest.mark.parametrize(("delay", "value"), [(-0.02, 1.0), (0.0, 1.0), (0.4, 250.0)])
def test_zero_would_mean_the_drivers_own_and_more_than_the_ekf_keeps_is_not_set(delay, value):
    assert FixClock().setting(delay) == value
