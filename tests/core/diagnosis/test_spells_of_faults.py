"""When a false receiver was false, though the filter had taken its error for a velocity."""

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.faults import fault_effect
from onboard.core.filter.traces import Traces
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

LEAST, COAST_S, STEP_S = 0.7, 30.0, 0.2
OFF = np.array([-0.6, 0.8])


@pytest.fixture(scope="module")
def batches():
    spec = FlightSpec(vehicle="copter", seed=1, duration=60.0, imus=random_imus(1))
    return heard(spec).engine(1).batches


def flight(*stages):
    """Epochs by stage: (until, innovation, why it was refused)."""
    out, t = Traces(), 0.0
    for until, innovation, refused in stages:
        while t < until - 1e-6:
            off = np.array(innovation)
            taken = np.zeros((0, 1)) if refused else off[:, None]
            out.add(np.array([t]), np.array([len(taken)]), taken)
            out.add_refused(refused, off if refused else np.zeros(0))
            t += STEP_S
    return out


def interval(stages, batches):
    found = fault_effect(flight(*stages), batches, 0.0, LEAST, COAST_S)
    assert found is not None
    assert len(found.intervals) == 1
    return found.intervals[0]


V, R = ("velocity",), ("recovery",)
NONE = (0.0, 0.0)


@pytest.mark.slow
def test_a_short_fault_ends_when_the_velocity_is_right_again(batches):
    stages = [(20, NONE, ()), (22, OFF, V), (24, NONE, R), (60, NONE, ())]
    assert interval(stages, batches) == pytest.approx((20.0, 21.8), abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("patience", [1.6, 8.0, 20.0])
def test_one_that_the_filter_gave_in_to_ends_at_the_jump_back(batches, patience):
    gave_in = 20 + patience
    stages = [
        (20, NONE, ()),
        (gave_in, OFF, V),
        (gave_in + 2, 0.8 * OFF, R),
        (45, NONE, ()),
        (46, -OFF, V),
        (48, -OFF, R),
        (60, NONE, ()),
    ]
    assert interval(stages, batches) == pytest.approx((20.0, 45.0), abs=0.01)


def test_a_filter_that_is_off_by_something_else_at_once_does_not_join_two_spells(batches):
    stages = [
        (20, NONE, ()),
        (34, OFF, V),
        (35.6, 0.8 * OFF, R),
        (35.8, NONE, ()),
        (40, -0.2 * OFF, V),
        (60, -1.3 * OFF, V),
    ]
    assert interval(stages, batches) == pytest.approx((20.0, 40.0), abs=0.01)


def test_what_the_filter_jumps_by_when_it_gives_in_is_not_the_end(batches):
    stages = [
        (20, NONE, ()),
        (34, OFF, V),
        (35.8, 0.8 * OFF, R),
        (36.0, NONE, ()),
        (44, (0.1, -0.1), V),
        (44.6, np.array([0.1, -0.1]) - OFF, V),
        (60, NONE, ()),
    ]
    assert interval(stages, batches) == pytest.approx((20.0, 44.0), abs=0.01)


@pytest.mark.parametrize("first", [0.1, 2.0])
def test_drift_of_the_inertia_is_no_fault(batches, first):
    growing = [(20 + k * STEP_S, (first * (1.0 + 0.1 * k), 0.0), V) for k in range(1, 60)]
    found = fault_effect(flight((20, NONE, ()), *growing), batches, 0.0, LEAST, COAST_S)
    assert found is None
