"""Status by what all accelerometers of a vehicle know, and who has a say in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.answers.answer import Answer
from onboard.answers.recorded import unanswered
from onboard.answers.together import judged, takes_part, together
from onboard.core.estimate.comparison import compare
from onboard.core.estimate.observability import Needs
from onboard.core.estimate.result import Status, Together
from onboard.core.physics.catalogue import adds_to_force, kinds
from onboard.core.physics.effect import Bearing
from tests.cli.results import CALIBRATED
from tests.core.estimate.test_with_others import vehicle

ALONE = replace(CALIBRATED, status=Status.INSUFFICIENT, believed=True)


def knowing(c, sigma, change):
    """What is known with accelerometer 2: an x offset that changes by so much, that surely."""
    six = np.array(c.in_force_scale + c.in_force_offset)
    six[3] += change
    covariance = np.diag(np.array([0.03, 0.03, 0.03, sigma, 0.5, 0.5]) ** 2)
    known = Together((1, 2), tuple(six[:3]), tuple(six[3:]), tuple(map(tuple, covariance)))
    return replace(c, together=known)


def test_what_others_make_sure_is_calibrated_and_says_so():
    c = judged(knowing(ALONE, 0.01, 0.2), Needs())
    assert c.status is Status.CALIBRATED
    assert c.note.startswith("by itself it is not sure enough, with what accelerometer 2 felt")
    assert c.note.endswith(ALONE.note)


def test_what_is_not_sure_beside_the_others_is_none():
    c = judged(knowing(CALIBRATED, 0.2, 0.1), Needs())
    assert c.status is Status.INSUFFICIENT
    assert "accelerometer 2" in c.note


@pytest.mark.parametrize("c", [CALIBRATED, ALONE])
def test_one_that_nobody_adds_to_keeps_its_status(c):
    assert judged(c, Needs()) is c


def answered(c, *effects, missing=""):
    given = unanswered(c)
    return Answer(replace(given.diagnosis, effects=effects), missing)


class Named:
    """An effect by its name alone."""

    def __init__(self, name):
        self.name = name


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.effect)
def test_whose_force_is_not_of_the_six_alone_takes_no_part(kind):
    given = answered(ALONE, Named(kind.effect))
    in_every_one = kind.bearing is Bearing.HARMLESS
    assert takes_part(given) is (in_every_one or not adds_to_force(kind.effect))


def test_what_a_receiver_does_or_an_attitude_is_no_force_of_an_accelerometer():
    alike = {"gps_lever_arm", "gps_smoothing", "clock_skew", "heading_error", "offset_wander"}
    own = {"cross_axis", "mount_tilt", "vibration_rectification", "bias_step", "load_flex"}
    assert all(takes_part(answered(ALONE, Named(e))) for e in alike)
    assert not any(takes_part(answered(ALONE, Named(e))) for e in own)


def test_who_is_doubted_or_lacks_physics_takes_no_part():
    assert takes_part(answered(ALONE))
    assert not takes_part(answered(replace(ALONE, believed=False)))
    assert not takes_part(answered(ALONE, missing="it bends"))
    assert not takes_part(answered(ALONE, Named("an effect that nobody knows")))


def test_only_what_is_to_be_set_changes():
    wanted, records, flown = vehicle(np.random.default_rng(3), (0.2, 4.0))
    answers = [answered(c) for c in records]
    made = together(answers, compare(records, (flown,)), Needs())
    for c, a in zip(records, made, strict=True):
        assert a.calibration.together.imus == tuple(wanted)
        assert replace(a.calibration, together=None, status=c.status, note=c.note) == c
    assert together(answers, None, Needs()) == tuple(answers)
