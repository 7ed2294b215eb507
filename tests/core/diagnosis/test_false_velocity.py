"""A receiver that is off by one error for a while is no jump of the accelerometer, nor one it."""

from types import SimpleNamespace

import numpy as np
import pytest

from onboard.core.diagnosis.false_velocity import FalseVelocity
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


def test_velocities_are_off_for_as_long_as_it_lasts_and_by_the_same():
    t = np.array([1.0, 2.0, 3.0, 4.0])
    around = SimpleNamespace(now=SimpleNamespace(t=t))
    ned = FalseVelocity(2.0, 3.0).velocity(around).ned
    assert ned.shape == (4, 3, 2)
    assert np.array_equal(ned[1:3] @ [1.4, -0.3], [[1.4, -0.3, 0.0]] * 2)
    assert not ned[[0, 3]].any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "north", "east", "lasts"),
    [("plane", 1.4, 0.0, 22.0), ("copter", -1.0, 1.2, 20.0), ("copter", 1.2, 0.5, 40.0)],
)
def test_an_error_that_the_filter_gets_used_to_is_the_receivers(vehicle, north, east, lasts):
    """After some seconds it passes for a velocity, and at its end for an error the other way."""
    fault = concealed.GpsFault(start=60.0, end=60.0 + lasts, north=north, east=east)
    said, first = told(vehicle, 4711, fault)
    assert said.verdict is Verdict.EXPLAINED
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((fault.start, fault.end), abs=1.0)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(north, east), abs=3.0 * offset.sigma)
    assert offset.sigma < 0.3


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "seed"), [("copter", 4721), ("plane", 4722)])
def test_a_small_error_that_is_taken_back_is_told_by_its_likelihood(vehicle, seed):
    """No more than an ordinary receiver's; the filter is used to it after a second."""
    fault = concealed.GpsFault(start=60.0, end=74.0, north=-0.5, east=0.47)
    said, first = told(vehicle, seed, fault)
    (effect,) = said.effects
    assert effect.name == "gps_fault"
    ((begin, end),) = effect.intervals
    assert (begin + first, end + first) == pytest.approx((fault.start, fault.end), abs=1.0)
    offset = effect.unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(0.5, 0.47), abs=3.0 * offset.sigma)


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
@pytest.mark.parametrize("vehicle", ["copter", "plane"])
def test_a_jump_that_makes_a_receiver_look_false_is_no_fault(vehicle):
    jump = concealed.BiasStep(time=70.0, x=0.7, y=-0.6, z=0.4)
    said, _ = told(vehicle, 4713, jump)
    (effect,) = said.effects
    assert effect.name == "bias_step"
    for axis, size in zip("xyz", (0.7, -0.6, 0.4), strict=True):
        seen = effect.unknowns[axis]
        assert seen.value == pytest.approx(size, abs=3.0 * seen.sigma + 0.02)


@pytest.mark.slow
def test_a_fault_beside_a_jump_is_said_beside_it():
    fault = concealed.GpsFault(start=50.0, end=65.0, north=1.2, east=-1.1)
    jump = concealed.BiasStep(time=100.0, x=0.6, y=0.5, z=-0.4)
    said, _ = told("copter", 4714, fault, jump, duration=170.0)
    effects = {effect.name: effect for effect in said.effects}
    assert set(effects) == {"bias_step", "gps_fault"}
    offset = effects["gps_fault"].unknowns["offset"]
    assert offset.value == pytest.approx(np.hypot(1.2, 1.1), abs=3.0 * offset.sigma)
