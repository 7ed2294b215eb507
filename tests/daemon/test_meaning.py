"""The estimator alone knows the parameters in force; the next one is told all that matters."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.gps_clock import fix_clock
from onboard.core.inputs.parameters import HELD, ParametersInForce
from onboard.core.inputs.samples import ParameterValue
from onboard.core.inputs.views import ASKED
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.learning.flight import Judged
from onboard.daemon.learning.identity import Identity
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.meaning import (
    carried,
    corrections,
    hand_on,
    matters,
    meanings,
    same_sensors,
)
from onboard.daemon.learning.meaning import in_force as in_force_of
from onboard.daemon.learning.store import Store
from onboard.daemon.pushing.parameters import NEEDED
from onboard.push.diagnosed import Diagnosed
from tests.daemon.daemons import calibration

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
    assert meanings(second.parameters.values) == meanings(first.parameters.values)
    assert second.parameters.trim == first.parameters.trim
    assert (second.parameters.lever_arm(1) == first.parameters.lever_arm(1)).all()


class Asked(dict):
    """Parameters that note which of them anybody looks for."""

    def __init__(self, values):
        super().__init__(values)
        self.names = set()

    def __contains__(self, name):
        self.names.add(name)
        return super().__contains__(name)


@pytest.mark.parametrize("told", [{}, {"AHRS_TRIM_X": 0.0}, {"AHRS_EKF_TYPE": 0.0}])
@pytest.mark.parametrize("receiver", [1, 2])
def test_whatever_an_estimator_looks_for_is_asked_for_and_handed_on(told, receiver):
    """Else a live flight is learned as if it had the default, and its recording is not."""
    asked = Asked(told)
    parameters = ParametersInForce(asked, receiver=receiver)
    for name in dir(ParametersInForce):
        if isinstance(getattr(ParametersInForce, name), property):
            getattr(parameters, name)
    for imu in (1, 2, 3):
        parameters.one_chip(imu)
        parameters.lever_arm(imu)
        asked.names |= {parameter_names(imu).gyro_id, *parameter_names(imu).six}
    fix_clock(parameters, ())
    asked.names |= {*HELD, *ASKED}
    assert asked.names <= NEEDED
    assert {name for name in asked.names if not matters(name)} == set()


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
    before = meanings(in_force(made))
    assert before[1].six is not None
    made.reset()
    assert meanings(in_force(made)) == before


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


@pytest.mark.parametrize(
    ("then", "now", "changed"),
    [
        ({}, {}, ""),
        ({"INS_TCAL1_ENABLE": 0.0}, {"INS_TCAL1_ENABLE": 1.0}, "INS_TCAL1_ENABLE"),
        ({"INS_TCAL1_ENABLE": 1.0}, {"INS_TCAL1_ENABLE": 1.0}, ""),
        (
            {"INS_TCAL1_ENABLE": 1.0, "INS_ACC1_CALTEMP": 30.0},
            {"INS_TCAL1_ENABLE": 1.0, "INS_ACC1_CALTEMP": 45.0},
            "INS_ACC1_CALTEMP",
        ),
        (
            {"INS_TCAL1_ENABLE": 1.0, "INS_TCAL1_ACC1_X": 2.0},
            {"INS_TCAL1_ENABLE": 1.0, "INS_TCAL1_ACC1_X": 3.0},
            "INS_TCAL1_ACC1_X",
        ),
        ({"INS_ACC1_CALTEMP": 30.0}, {"INS_ACC1_CALTEMP": 45.0}, ""),  # nothing is corrected
        ({}, {"INS_TCAL1_ENABLE": 1.0}, ""),  # it may have been so all the time
        ({"INS_TCAL2_ENABLE": 0.0}, {"INS_TCAL2_ENABLE": 1.0}, ""),  # another accelerometer
        ({SIX[0]: 1.0}, {SIX[0]: 1.01}, "INS_ACCSCAL_X from 1 to 1.01"),
    ],
)
def test_what_raw_values_are_is_more_than_the_six(then, now, changed):
    """A correction for temperature comes before scale and offset."""
    six = dict.fromkeys(parameter_names(1).six, 1.0)
    found = Diagnosed(1, "clean", (), calibration())
    judged = Judged(1.0, in_force_of(six | then, 1), found, corrections(six | then, 1))
    assert judged.changed_since(six | now, 1, ()) == changed


def test_what_we_have_written_ourselves_is_nobodys_change():
    six = dict.fromkeys(parameter_names(1).six, 1.0)
    judged = Judged(1.0, (1.0,) * 6, Diagnosed(1, "clean", (), calibration()))
    written = (1.5, *(1.0,) * 5)
    assert judged.changed_since(six | {SIX[0]: 1.5}, 1, written) == ""
    changed = judged.changed_since(six | {SIX[0]: 1.5, SIX[1]: 2.0}, 1, written)
    assert changed == "INS_ACCSCAL_Y from 1 to 2"


def test_another_sensor_or_correction_is_another_meaning():
    names = parameter_names(1)
    values = dict.fromkeys(names.six, 1.0) | {names.device_id: 7.0, "INS_TCAL1_ENABLE": 0.0}
    before = meanings(values)
    assert same_sensors(before, meanings(values))
    assert same_sensors(before, meanings({n: x for n, x in values.items() if n in names.six}))
    for name, value in ((names.device_id, 8.0), (names.six[3], 1.1), ("INS_TCAL1_ENABLE", 1.0)):
        assert not same_sensors(before, meanings(values | {name: value}))
