"""The estimator alone knows the parameters in force; the next one is told all that matters."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.samples import ParameterValue
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.meaning import all_in_force, carried, hand_on
from onboard.daemon.learning.store import Store

SIX = tuple(name for imu in (1, 2) for name in parameter_names(imu).six)
NAMES = st.sampled_from([*SIX, "AHRS_ORIENTATION", "AHRS_TRIM_X", "GPS1_POS_X"])
TOLD = st.lists(st.tuples(NAMES, st.sampled_from([0.0, 0.5, 1.0, 1.02])), max_size=20)


@given(TOLD)
def test_what_is_handed_on_means_the_same_to_the_next_estimator(told):
    first, second = Calibrator(), Calibrator()
    for name, value in told:
        first.feed(ParameterValue(name, value))
    hand_on(carried(first.parameters), second)
    assert second.parameters.values == first.parameters.values
    assert all_in_force(second.parameters.values) == all_in_force(first.parameters.values)
    assert second.parameters.trim == first.parameters.trim
    assert (second.parameters.lever_arm(1) == first.parameters.lever_arm(1)).all()


def learner(tmp_path):
    made = Learner(Store(tmp_path), Calibrator().settings, clock=float, wall_clock=float)
    made.identify(Identity(1, board="aa"))
    values = [ParameterValue(name, 1.02) for name in (*SIX, "FRAME_CLASS")]
    made.learn(values, judging=())
    return made


def in_force(made):
    return made._calibrator.parameters.values


def test_a_reset_forgets_what_was_learned_and_not_what_the_messages_mean(tmp_path):
    made = learner(tmp_path)
    before = all_in_force(in_force(made))
    assert before[1] is not None
    made.reset()
    assert all_in_force(in_force(made)) == before


def test_of_another_board_nothing_is_known_but_what_it_has_told(tmp_path):
    made = learner(tmp_path)
    made.gap()
    made.identify(Identity(1, board="bb"), [ParameterValue(SIX[0], 0.99)])
    assert in_force(made) == {SIX[0]: 0.99}


def test_the_same_board_with_a_changed_value_keeps_the_others(tmp_path):
    made = learner(tmp_path)
    made.gap()
    made.identify(Identity(1, board="aa"), [ParameterValue(SIX[0], 0.99)])
    assert in_force(made)[SIX[0]] == 0.99
    assert in_force(made)[SIX[1]] == 1.02
