"""What the challenge takes for true numbers, and how it counts those that are off."""

import numpy as np
import pytest

from benchmarks.explaining import listened
from benchmarks.numbers import Numbers, numbers, numbers_row
from benchmarks.true_numbers import true_six
from onboard.core.diagnosis.procedure import examine
from sitl.builtin.effects import BiasStep, ScaleStep
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, run

IMU = ImuTruth(scale=(1.02, 0.98, 1.01), offset=(0.2, -0.3, 0.1), bias_walk=0.0)
JUMP = BiasStep(time=70.0, x=0.6, y=-0.5)


@pytest.fixture(scope="module")
def jumped():
    flight = run(FlightSpec(duration=130.0, seed=3, imus=(IMU,), effects=(JUMP,)))
    calibrator = listened(flight)
    return flight, calibrator, examine(calibrator, 1)


def test_of_what_the_model_has_the_six_are_those_without_it(jumped):
    flight, _, judge = jumped
    assert true_six(judge, flight, 1, ["bias_step"]).tolist() == [*IMU.scale, *IMU.offset]


def test_of_what_it_has_not_they_are_those_that_fit_the_flight(jumped):
    judge = jumped[2]
    # Another flight's effects, which act from the first sample on, on the same motion.
    always = ScaleStep(time=0.0, x=0.03, y=-0.02), BiasStep(time=0.0, z=0.4)
    other = run(FlightSpec(duration=130.0, seed=3, imus=(IMU,), effects=always))
    judge.final.families, families = [], judge.final.families
    six = true_six(judge, other, 1, [])
    judge.final.families = families
    # raw = (f + c f + b) / s + o: what has to be taken off, and what is left to multiply by.
    scale = np.array(IMU.scale) / (1.03, 0.98, 1.0)
    offset = np.array(IMU.offset) + np.array([0.0, 0.0, 0.4]) / IMU.scale
    assert six == pytest.approx([*scale, *offset], abs=1e-6)


def test_a_jump_has_numbers_before_it_and_after_it(jumped):
    flight, calibrator, judge = jumped
    said = judge.diagnosis()
    before, after = numbers(judge, said, calibrator, flight)
    assert (before.after, after.after) == (False, True)
    assert not before.offered, "a jump is withheld"
    step = next(e for e in said.effects if e.name == "bias_step")
    found = np.array([step.unknowns[a].value for a in "xyz"])
    scale = before.error[:3] + IMU.scale
    assert after.error[3:] - before.error[3:] == pytest.approx((found - JUMP.sizes) / scale)
    assert max(before.chi_square, after.chi_square) < 22.5, "of six: one flight in a thousand"


def test_numbers_past_three_sigma_are_counted_where_they_are_dangerous():
    def given(off, *, offered):
        return Numbers(
            imu=1,
            error=np.array([off, 0.0, 0.0, 0.0, 0.0, -0.01]),
            covariance=1e-4 * np.eye(6),
            calibrated=True,
            offered=offered,
            modelled=(),
            force=(0.3, 0.1, 0.05),
        )

    right, wrong, withheld = (
        given(0.01, offered=True),
        given(0.04, offered=True),
        given(float("nan"), offered=False),
    )
    assert [n.far for n in (right, wrong, withheld)] == [0, 1, 1], "what is no number is off"
    assert right.chi_square == pytest.approx(2.0)
    cells = [c.strip() for c in numbers_row("some", [right, wrong]).split("|")[1:-1]]
    assert cells == ["some", "12", "1", "4.0", "1.58", "2", "1", "2", "1", "2.0", "0"]
