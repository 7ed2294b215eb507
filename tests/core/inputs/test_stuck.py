"""An accelerometer that repeats one reading has measured nothing meanwhile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.limits import SAME_M_S2, STUCK_S
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, VehicleState
from onboard.core.inputs.stuck import stuck
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages


def test_readings_that_stay_for_a_second_are_stuck_and_no_others():
    t = np.arange(0.0, 10.0, 0.02)
    f = np.column_stack([np.sin(t), np.cos(t), -9.8 + 0.1 * np.sin(3.0 * t)])
    dead, short = (t >= 3.0) & (t <= 3.0 + STUCK_S), (t >= 6.0) & (t < 6.0 + 0.9 * STUCK_S)
    for span in (dead, short):
        f[span] = f[span][0]
    np.testing.assert_array_equal(stuck(t, f, SAME_M_S2), dead)


def low_passed(x, cutoff_hz, rate_hz):
    """ArduPilot's two-pole low-pass (direct form II), reckoned in float32 as on its boards."""
    one = np.float32(1.0)
    fr = np.float32(rate_hz / cutoff_hz)
    ohm = np.float32(np.tan(np.pi / fr))
    c = one + np.float32(2.0 * np.cos(np.pi / 4.0)) * ohm + ohm * ohm
    b0 = ohm * ohm / c
    a1 = np.float32(2.0) * (ohm * ohm - one) / c
    a2 = (one - np.float32(2.0 * np.cos(np.pi / 4.0)) * ohm + ohm * ohm) / c
    d1 = d2 = np.float32(0.0)
    out = np.empty(len(x), dtype=np.float32)
    for k, value in enumerate(x.astype(np.float32)):
        d0 = value - d1 * a1 - d2 * a2
        out[k] = d0 * b0 + d1 * (b0 + b0) + d2 * b0
        d1, d2 = d0, d1
    return out.astype(np.float64)


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 4000.0])
@pytest.mark.parametrize("value", [0.5, 2.4999, -9.80665, 156.9])
def test_a_filter_that_goes_on_by_its_roundings_does_not_hide_it(rate, value):
    """The filter behind a dead sensor does not come to rest: HIGHRES_IMU tells float32."""
    filtered = low_passed(np.full(int(3 * rate), value), 20.0, rate)
    every = int(rate / 50.0)
    at_rest = filtered[int(rate) :: every]
    t = np.arange(len(at_rest)) / 50.0
    rng = np.random.default_rng(3)
    f = np.column_stack([np.roll(at_rest, int(k)) for k in rng.integers(0, 5, 3)])
    assert np.all(stuck(t, f, SAME_M_S2))


@pytest.mark.parametrize("every", [1, 2, 5, 20])
@pytest.mark.parametrize("cutoff_hz", [5.0, 20.0, 80.0])
def test_a_filter_that_comes_to_rest_by_and_by_does_not_hide_it(every, cutoff_hz):
    """At the rates of logs it does so by less than a reading's tolerance from sample to sample."""
    rate, died, ended = 1000.0, 3.0, 7.0
    t = np.arange(0.0, 10.0, 1.0 / rate)
    shaken = 0.3 * np.random.default_rng(4).standard_normal((len(t), 3))
    shaken[(t >= died) & (t < ended)] = shaken[int(died * rate)]
    filtered = np.column_stack([low_passed(x, cutoff_hz, rate) for x in shaken.T])[::every]
    found = t[::every][stuck(t[::every], filtered, SAME_M_S2)]
    settled_s = 2.0 / cutoff_hz + 2.0 * every / rate  # nine time constants, and two readings
    assert died <= found[0] <= died + settled_s
    assert ended - 0.05 <= found[-1] <= ended + 0.05
    assert len(found) * every / rate >= ended - died - settled_s - 0.05


def test_what_creeps_is_not_the_same():
    t = np.arange(0.0, 10.0, 0.02)
    creeping = np.column_stack([0.5 * SAME_M_S2 * np.arange(len(t))] * 3)
    assert not np.any(stuck(t, creeping, SAME_M_S2))


def test_the_quietest_sensor_is_not_the_same():
    """25 micro-g a root of a hertz behind 20 Hz, at rest: an hour of it."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 3600.0, 0.02)
    f = 25e-6 * 9.80665 * np.sqrt(20.0) * rng.standard_normal((len(t), 3))
    assert not np.any(stuck(t, f, SAME_M_S2))


def test_one_axis_that_stays_is_no_dead_accelerometer():
    t = np.arange(0.0, 10.0, 0.02)
    f = np.column_stack([np.zeros_like(t), np.zeros_like(t), -9.8 + 0.1 * np.sin(3.0 * t)])
    assert not np.any(stuck(t, f, SAME_M_S2))


def test_no_samples_are_not_stuck():
    assert stuck(np.zeros(0), np.zeros((0, 3)), SAME_M_S2).shape == (0,)


@pytest.mark.parametrize("rate", [10.0, 25.0, 50.0])
def test_coarse_readings_of_a_quiet_flight_are_not_stuck(rate):
    """A thousandth of g is the step, and all that shakes the vehicle: an hour of it."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 3600.0, 1.0 / rate)
    f = 9.80665e-3 * np.round(rng.standard_normal((len(t), 3)))
    assert not np.any(stuck(t, f, SAME_M_S2))


@pytest.fixture(scope="module")
def flight():
    truth = ImuTruth(scale=(1.02, 0.98, 1.01), offset=(0.2, -0.15, 0.1))
    spec = FlightSpec(vehicle="copter", seed=4, duration=150.0, imus=(truth,))
    decoder = Decoder()
    return [s for _, message in fly_messages(spec) for s in decoder.decode(message)]


def learned(samples):
    calibrator = Calibrator()
    for sample in samples:
        calibrator.feed(sample)
    calibrator.finish()
    return calibrator, calibrator.calibration(1)


@pytest.mark.slow
def test_what_is_learned_is_of_the_flight_without_it(flight):
    died, ended = 80.0, 110.0

    def broken(sample):
        dead = isinstance(sample, ImuSample) and died <= sample.t <= ended
        return replace(sample, f_b=(1.0, 1.0, 1.0)) if dead else sample

    _, whole = learned(flight)
    calibrator, without = learned(map(broken, flight))
    ((start, end),) = calibrator.stuck(1)
    assert (start, end) == pytest.approx((died, ended), abs=0.05)
    found, sigma = np.array(without.scale + without.offset), np.array(without.scale_sigma)
    assert np.all(np.abs(found - np.array(whole.scale + whole.offset))[:3] < 3.0 * sigma)
    assert without.trusted_s == pytest.approx(whole.trusted_s - (ended - died), abs=3.0)


def hovering(begin, end, *, dead=(), still=True):
    """Samples of a hover in a simulator without noise, or of one that turns a little."""
    out, rng = [], np.random.default_rng(3)
    said = VehicleState(begin + 0.5, armed=True, landed=False, kind="copter")
    for t in np.arange(begin, end, 0.02).tolist():
        w_b = (0.0, 0.0, 0.0) if still else tuple(0.05 * rng.standard_normal(3))
        f_b = (0.0, 0.0, -9.81)
        if not still and not any(a <= t <= b for a, b in dead):
            f_b = tuple(np.array(f_b) + 0.01 * rng.standard_normal(3))
        out.append(ImuSample(t, 1, f_b, w_b))
        if round(50.0 * t) % 10 == 0:
            out += [
                AttitudeSample(t, 0.01, 0.0, 0.1),
                GpsFix(t, 1, 3, 0.5, 0.5, 10.0, 0.0, 0.0, satellites=12),
            ]
    return sorted([*out, said], key=lambda sample: sample.t)


def stuck_of(samples):
    calibrator = Calibrator()
    for sample in samples:
        calibrator.feed(sample)
    calibrator.finish()
    return calibrator.stuck(1)


def test_a_simulator_without_noise_that_hovers_is_not_told_of():
    assert stuck_of(hovering(10.0, 60.0)) == ()


def test_what_is_repeated_in_another_boot_is_another_time():
    """Also where it comes earlier by the boot's own clock."""
    first = hovering(100.0, 150.0, dead=[(130.0, 134.0)], still=False)
    second = hovering(20.0, 70.0, dead=[(50.0, 54.0)], still=False)
    spells = stuck_of([*first, *second])
    assert [start for start, _ in spells] == pytest.approx([130.0, 50.0], abs=0.05)
