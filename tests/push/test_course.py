"""What waits in a course for the next word that the vehicle is disarmed."""

from __future__ import annotations

from onboard.mavlink.parameter_messages import SendParamSet
from onboard.push.course import Course, TransactionSettings
from onboard.push.entries import Purpose
from onboard.push.states import State
from tests.push.pushing import make_plan


def writing():
    course = Course(make_plan(), "push", Purpose.PUSH, TransactionSettings())
    course.state = State.WRITING
    return course


def test_a_new_value_waits_for_a_heartbeat_that_says_disarmed():
    course = writing()
    course.send(SendParamSet("INS_ACCSCAL_X", 1.01), 10.0)
    assert course.flush() == ()
    course.disarmed(11.0, 11.0)
    assert course.flush() == (SendParamSet("INS_ACCSCAL_X", 1.01),)


def test_a_repetition_of_what_is_read_back_meanwhile_is_not_sent_any_more():
    course = writing()
    course.send(SendParamSet("INS_ACCSCAL_X", 1.01), 10.0)
    course.answered("INS_ACCSCAL_X")
    course.disarmed(11.0, 11.0)
    assert course.flush() == ()


def test_a_word_that_was_long_on_its_way_lets_nothing_go():
    course = writing()
    course.send(SendParamSet("INS_ACCSCAL_X", 1.01), 10.0)
    course.disarmed(11.0, 14.0)
    assert course.flush() == ()
    course.disarmed(14.0, 14.1)
    assert course.flush() == (SendParamSet("INS_ACCSCAL_X", 1.01),)


def test_time_for_old_values_is_counted_from_when_it_may_have_armed():
    """In a silence, it may have said so first when nobody heard it."""
    settings = TransactionSettings()
    for disarmed, armed in ((10.0, 11.0), (10.0, 14.0), (10.0, 30.0)):
        course = writing()
        course.disarmed(disarmed, disarmed)
        course.armed(armed)
        first = min(armed, disarmed + settings.fresh_s)
        assert course.undo_until == first + settings.armed_undo_s
        course.armed(armed + 1.0)
        assert course.undo_until == first + settings.armed_undo_s
