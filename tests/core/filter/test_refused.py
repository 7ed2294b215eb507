"""Velocities that another pass has refused."""

import numpy as np
import pytest

from onboard.core.filter.innovation_gates import GATE_VELOCITY, InnovationGates
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.refused import Refused
from onboard.core.filter.uncertainty import Covariance
from onboard.core.model.linearisation import Linearisation


def test_stamps_are_known_through_another_latency():
    stamps = np.arange(100.0, 110.0, 0.2)
    one = Linearisation(delay=0.12, skew=2e-4, skew_from=90.0)
    bad = stamps[[3, 7]]
    refused = Refused(
        zip(one.stamp(one.true_time(bad)).tolist(), ("velocity", "recovery"), strict=True)
    )
    assert [s for s in stamps if refused.by(s)] == pytest.approx(bad)
    assert (refused.by(bad[0]), refused.by(bad[1])) == ("velocity", "recovery")


def judged(y, velocity):
    made = InnovationGates(NoiseLevels())
    E, h = np.column_stack([y, np.zeros(3)]), np.zeros((3, 1))
    none = np.zeros(1)
    known = Covariance(np.zeros((1, 1)))
    return made.judge(0.0, "vvv", E, y, h, none, known, np.eye(3), velocity=velocity)


def test_what_is_known_is_not_judged():
    far, near = np.full(3, np.sqrt(GATE_VELOCITY)), np.zeros(3)
    assert judged(far, None).name == "velocity"
    assert judged(near, None) is None
    assert judged(far, "") is None
    assert judged(near, "recovery").name == "recovery"
