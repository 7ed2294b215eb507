"""A jump of one accelerometer of several is said of that one; of none if nothing tells."""

import dataclasses
import functools
from typing import cast

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.evidence import Judge
from onboard.core.diagnosis.hypotheses import Choice, of_others
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.selection import Fitter
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.limits import SHARED_WINDOW_S
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import BiasStep, Witness
from onboard.mavlink.decode import Decoder
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages

AT = 61.3
SPEC = FlightSpec(vehicle="copter", seed=23, duration=110.0, imus=random_imus(23, 3))


@functools.cache
def flown(imus: int, step: concealed.BiasStep) -> Calibrator:
    """What has listened to a flight of a vehicle of several; each is asked of each."""
    return heard(dataclasses.replace(SPEC, imus=SPEC.imus[:imus], effects=(step,)))


@functools.cache
def judged(imus: int, asked: int, *, at: float, **step) -> Judge:
    """One accelerometer of a vehicle of several, ``step`` concealed."""
    return examine(flown(imus, concealed.BiasStep(time=at, **step)), asked)


@pytest.fixture(scope="module", autouse=True)
def _forgotten():
    """Flights are long: they go when they have been asked."""
    yield
    judged.cache_clear()
    flown.cache_clear()


def offsets(judge: Judge):
    """Offset found less the concealed one before the jump, and its sigma."""
    c = judge.calibration
    truth = np.array(SPEC.imus[judge.imu - 1].offset)
    return np.array(c.offset) - truth, np.array(c.offset_sigma)


@pytest.mark.slow
def test_of_three_a_small_jump_is_said_of_the_one_that_made_it():
    """5 cm/s^2: GPS alone shows it at the edge, the others without doubt."""
    asked = {imu: judged(3, imu, at=AT, imu=2, x=0.05, y=-0.04) for imu in (1, 2)}
    said = {imu: judge.diagnosis() for imu, judge in asked.items()}
    assert "bias_step" not in {e.name for e in said[1].effects}
    (jump,) = (e for e in said[2].effects if e.name == "bias_step")
    time = jump.unknowns["time"]
    since_start = AT - asked[2].final.origin.t0
    assert time.value == pytest.approx(since_start, abs=3.0 * time.sigma)
    for axis, size in zip("xyz", (0.05, -0.04, 0.0), strict=True):
        found = jump.unknowns[axis]
        assert found.value == pytest.approx(size, abs=4.0 * found.sigma)
        assert found.sigma < 0.01


@pytest.mark.slow
def test_of_three_one_that_breaks_is_said_to_have_jumped():
    """5 m/s^2 is more than any that is merely miscalibrated; the others see that it is this one."""
    (jump,) = (
        e for e in judged(3, 2, at=AT, imu=2, x=5.0).diagnosis().effects if e.name == "bias_step"
    )
    assert abs(SPEC.imus[1].scale[0] - 1.0) > 0.03, "by so much they are compared wrongly"
    assert jump.unknowns["x"].value == pytest.approx(5.0, rel=0.01)
    assert jump.unknowns["y"].value == pytest.approx(0.0, abs=0.05)


@pytest.mark.slow
def test_of_three_the_moment_is_told_by_the_second_in_which_they_are_compared():
    """Half a second where it is in a window, a little more where it is between two of them."""
    sigmas = []
    for at in (AT - 1.05, AT - 0.8, AT):
        judge = judged(3, 2, at=at, imu=2, x=0.05, y=-0.04)
        (jump,) = (e for e in judge.diagnosis().effects if e.name == "bias_step")
        time = jump.unknowns["time"]
        assert time.value + judge.final.origin.t0 == pytest.approx(at, abs=3.0 * time.sigma)
        sigmas.append(time.sigma)
    assert np.median(sigmas) < 0.5
    assert max(sigmas) < SHARED_WINDOW_S


@pytest.mark.slow
@pytest.mark.parametrize("imu", [1, 2])
def test_of_two_nothing_is_said_wrongly_and_sigmas_hold(imu):
    """Whoever is asked: the jump is its own, the other's, or nobody's and in the sigmas."""
    judge = judged(2, imu, at=AT, imu=2, x=0.1)
    named = {e.name for e in judge.diagnosis().effects}
    assert "bias_step" not in named or imu == 2
    off, sigma = offsets(judge)
    if judge.choice.undecided is not None:
        assert "does not tell which" in judge.diagnosis().note
        assert sigma[0] > 0.02
    assert np.all(np.abs(off) < 4.0 * sigma)


@pytest.mark.slow
def test_a_jump_that_gps_shows_far_better_is_not_lost_to_one_that_the_other_shows():
    """The second one's jump is the larger in their difference, and at its moment half of ours."""
    ours = concealed.BiasStep(time=AT, imu=1, z=0.3)
    other = concealed.BiasStep(time=AT + 13.0, imu=2, x=-0.4, z=-0.2)
    both = dataclasses.replace(SPEC, imus=SPEC.imus[:2], effects=(ours, other))
    judge = examine(heard(both), 1)
    (jump,) = (e for e in judge.diagnosis().effects if "step" in e.name)
    assert jump.name == "bias_step"
    time = jump.unknowns["time"]
    assert time.value + judge.final.origin.t0 == pytest.approx(AT, abs=3.0 * time.sigma)
    for axis, size in zip("xyz", (0.0, 0.0, 0.3), strict=True):
        found = jump.unknowns[axis]
        assert found.value == pytest.approx(size, abs=3.0 * found.sigma)


@pytest.mark.slow
def test_what_all_do_alike_is_said_to_be_common():
    diagnosis = judged(2, 1, at=AT, imu=0, x=0.2, z=0.15).diagnosis()
    (jump,) = (e for e in diagnosis.effects if e.name == "bias_step")
    assert "what all accelerometers share" in jump.cure
    assert "all accelerometers ask for the same jump" in diagnosis.note


@pytest.mark.slow
def test_where_the_clock_began_anew_no_moment_is_asked_of_the_others():
    """Two boots in one recording: 61 s after the first is not 61 s after the second."""
    spec = dataclasses.replace(SPEC, imus=SPEC.imus[:2], duration=90.0)
    once, common = (
        dataclasses.replace(spec, effects=(concealed.BiasStep(time=AT, imu=imu, x=0.2, z=0.15),))
        for imu in (2, 0)
    )
    calibrator = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0))
    for boot in (once, common):
        decoder = Decoder()
        for _, message in fly_messages(boot):
            for sample in decoder.decode(message):
                calibrator.feed(sample)
    calibrator.finish()
    judge = examine(calibrator, 2)
    assert judge.choice.undecided is None
    assert "this accelerometer jumped" not in judge.diagnosis().note


@pytest.mark.parametrize(("size", "told"), [(0.003, False), (0.2, True)])
def test_a_jump_that_the_sigmas_do_not_notice_is_not_told(size, told):
    """It was told of as `x +0.00, y +0.00, z +0.00 m/s^2` of a plane whose sensors did not jump."""
    seen = Witness(50.0, 700, 0.0, np.array([0.2, 0.1, 1.0]) * size, np.full(3, 3e-4))
    choice = Choice(
        cast("Fitter", None), [], [], [], undecided=BiasStep(Origin(0.0)).at(169.0, seen)
    )
    sigma = np.array([1e-3, 1e-3, 1e-3, 0.03, 0.03, 0.004])
    claimed = sigma**2 + np.concatenate([np.zeros(3), (0.5 * seen.size) ** 2])
    assert ("does not tell which" in of_others(choice, 0.0, claimed)) is told
