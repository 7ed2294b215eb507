"""A receiver that is off for a while: when and by what; it is no jump of the accelerometer."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Verdict
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec
from tests.core.diagnosis.complaints import PROMPT, complained


def told(vehicle, seed, *effects, complaints=(), duration=150.0):
    """What is said of a flight whose EKF complains of GPS in ``complaints`` and nowhere else, s."""
    imus = random_imus(seed)
    spec = FlightSpec(
        vehicle=vehicle, seed=seed, duration=duration, imus=imus, gps=PROMPT, effects=effects
    )
    return complained(spec, complaints)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "north", "east", "lasts"),
    [("plane", 1.4, 0.0, 22.0), ("copter", 1.2, 0.5, 40.0)],
)
def test_an_error_that_the_filter_gets_used_to_is_the_receivers(vehicle, north, east, lasts):
    """After some seconds it passes for a velocity, and at its end for an error the other way."""
    fault = concealed.GpsFault(start=60.0, end=60.0 + lasts, north=north, east=east)
    said, first = told(vehicle, 4711, fault, duration=fault.end + 48.0)
    assert said.verdict is Verdict.EXPLAINED
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((fault.start, fault.end), abs=1.0)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(north, east), abs=3.0 * offset.sigma)
    assert offset.sigma < 0.3


@pytest.mark.slow
def test_a_small_error_that_is_taken_back_is_told_by_its_likelihood():
    """No more than an ordinary receiver's; the filter is used to it after a second."""
    fault = concealed.GpsFault(start=60.0, end=74.0, north=-0.5, east=0.47)
    said, first = told("copter", 4721, fault, duration=125.0)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((fault.start, fault.end), abs=1.0)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(0.5, 0.47), abs=3.0 * offset.sigma)


@pytest.mark.slow
def test_what_good_receivers_err_by_now_and_then_is_no_error_to_be_told():
    """However quiet this one is else, and however clearly it is seen."""
    fault = concealed.GpsFault(start=60.0, end=74.0, north=-0.26, east=0.2)
    said, _ = told("copter", 4721, fault, duration=125.0)
    assert said.effects == ()
    c, (truth, *_) = said.calibration, random_imus(4721)
    off = np.array([*c.scale, *c.offset]) - [*truth.scale, *truth.offset]
    assert np.all(np.abs(off) < 3.5 * np.array([*c.scale_sigma, *c.offset_sigma]))


@pytest.mark.slow
def test_what_comes_after_a_long_fault_is_not_its_size():
    """The EKF goes on complaining when the receiver is right again, as one does that was lost."""
    fault = concealed.GpsFault(start=60.0, end=110.0, north=-0.4, east=-2.4)
    said, _ = told("copter", 4712, fault, complaints=[(61.0, 115.0)])
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(0.4, 2.4), abs=3.0 * offset.sigma)
    assert effect.unknowns["duration"].value == pytest.approx(50.0, abs=1.5)


@pytest.mark.slow
def test_a_jump_that_makes_a_receiver_look_false_is_no_fault():
    jump = concealed.BiasStep(time=70.0, x=0.7, y=-0.6, z=0.4)
    said, _ = told("copter", 4713, jump, duration=125.0)
    (effect,) = said.effects
    assert effect.name == "bias_step"
    for axis, size in zip("xyz", (0.7, -0.6, 0.4), strict=True):
        seen = effect.unknowns[axis]
        assert seen.value == pytest.approx(size, abs=3.0 * seen.sigma + 0.02)


@pytest.mark.slow
def test_a_fault_beside_a_jump_is_said_beside_it():
    fault = concealed.GpsFault(start=50.0, end=65.0, north=1.2, east=-1.1)
    jump = concealed.BiasStep(time=100.0, x=0.6, y=0.5, z=-0.4)
    said, _ = told("copter", 4714, fault, jump, duration=150.0)
    effects = {effect.name: effect for effect in said.effects}
    assert set(effects) == {"bias_step", "gps_fault"}
    offset = effects["gps_fault"].unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(1.2, 1.1), abs=3.0 * offset.sigma)


@pytest.mark.slow
def test_an_error_that_grows_in_steps_is_told_by_its_last():
    steps = [(60.0, 0.9, -0.7), (67.0, 1.1, 0.4), (73.0, -0.5, 1.2)]
    faults = [concealed.GpsFault(start=t, end=80.0, north=n, east=e) for t, n, e in steps]
    said, first = told("plane", 4715, *faults, duration=130.0)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((60.0, 80.0), abs=0.5)
    offset = effect.unknowns["offset"]
    sizes = [np.hypot(*np.sum([s[1:] for s in steps[: k + 1]], axis=0)) for k in range(3)]
    assert offset.value == pytest.approx(max(sizes), abs=3.0 * offset.sigma)


@pytest.mark.slow
def test_two_errors_that_take_each_other_back_are_two_and_the_receiver_is_right_between():
    faults = [
        concealed.GpsFault(start=50.0, end=59.0, north=1.1, east=0.8),
        concealed.GpsFault(start=80.0, end=90.0, north=-1.1, east=-0.8),
    ]
    said, first = told("copter", 4716, *faults, duration=138.0)
    (effect,) = said.effects
    seen = [(a + first, b + first) for a, b in effect.intervals]
    assert np.allclose(seen, [(50.0, 59.0), (80.0, 90.0)], atol=0.5)


@pytest.mark.slow
def test_an_error_that_creeps_in_ends_where_the_receiver_jumps_back():
    faults = [
        concealed.GpsFault(start=60.0 + 0.2 * k, end=75.0, north=-0.03, east=0.02)
        for k in range(70)
    ]
    said, first = told("plane", 4717, *faults, duration=125.0)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((_, end),) = effect.intervals
    assert end + first == pytest.approx(75.0, abs=0.5)
    offset = effect.unknowns["offset"]
    # What a filter takes for a velocity while it grows is not in what it jumps back by.
    assert offset.value == pytest.approx(70 * np.hypot(0.03, 0.02), rel=0.15)


@pytest.mark.slow
def test_fixes_that_are_off_one_by_one_are_no_fault():
    """Each second of a minute one fix is off, by something else: that is what gates are for."""
    rng = np.random.default_rng(4718)
    faults = [
        concealed.GpsFault(
            start=50.0 + k, end=50.05 + k, north=rng.normal(0.0, 1.5), east=rng.normal(0.0, 1.5)
        )
        for k in range(60)
    ]
    said, _ = told("copter", 4718, *faults)
    assert not any(effect.name == "gps_fault" for effect in said.effects)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "seed", "ends", "fault", "warming", "delay"),
    [
        ("copter", 306, 94.32, (38.242, 57.782, 1.713, -1.641), (8.49, 52.12, 16.91), 0.0479),
        ("plane", 401, 129.03, (72.654, 83.209, 1.524, 1.780), (12.45, 49.96, 33.03), 0.0366),
    ],
)
def test_what_an_ekf_was_misled_by_is_no_drift(vehicle, seed, ends, fault, warming, delay):
    """Of a short flight: it tilts to where its accelerometer agrees with what it was told."""
    start, end, north, east = fault
    cold, warm, soon = warming
    (imu,) = random_imus(seed)
    imu = replace(imu, temperature_start=cold, temperature_end=warm, temperature_time=soon)
    spec = FlightSpec(
        vehicle=vehicle,
        seed=seed,
        duration=ends,
        imus=(imu,),
        gps=replace(PROMPT, delay=delay),
        effects=(concealed.GpsFault(start=start, end=end, north=north, east=east),),
    )
    said = diagnose(heard(spec), 1)
    assert [e.name for e in said.effects] == ["gps_fault"]
    c = said.calibration
    error = np.array((*c.scale, *c.offset)) - np.array((*imu.scale, *imu.offset))
    assert np.all(np.abs(error) < 3.0 * np.sqrt(np.diag(c.with_its_gyroscope)))
