"""Fixes that a link holds back: one steady answer, which says so."""

from __future__ import annotations

import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.gps.distrust import Distrust, WindowClosed, WindowOpened
from onboard.core.gps.trust import TrustWindow
from onboard.core.inputs.samples import ImuSample
from tests.core.gps.fixes import fix


def listened(window, late, start=100.0, end=160.0):
    """Inertial samples at 50 Hz, and fixes at 5 Hz that come ``late(t)`` s after their time."""
    events = []
    for k in range(round((end - start) * 50.0)):
        t = start + 0.02 * k
        events += window.feed(ImuSample(t, 1, (0.0, 0.0, -9.8)))
        if k % 10 == 0:
            events += window.feed(fix(t - late(t)))
    return events


@pytest.mark.parametrize("late", [2.6, 3.0, 5.0, 30.0])
def test_fixes_that_are_always_late_open_no_window(late):
    window = TrustWindow()
    assert listened(window, lambda _: late) == []
    assert window.reason is Distrust.LATE
    assert set(window.rejected) == {"late"}


@pytest.mark.parametrize("late", [0.5, 1.5, 2.2])
def test_fixes_that_are_late_by_less_than_a_gap_are_used(late):
    window = TrustWindow()
    assert listened(window, lambda _: late) == [WindowOpened(100.0 - late)]
    assert window.rejected == {}


def test_fixes_that_are_late_by_about_a_gap_close_it_once():
    window = TrustWindow()
    events = listened(window, lambda t: 2.4 if int(t) % 5 else 1.4)
    assert [type(e) for e in events] == [WindowOpened, WindowClosed]
    assert window.reason is Distrust.LATE


def test_once_they_come_in_time_again_they_are_believed():
    window = TrustWindow()
    listened(window, lambda t: 3.0 if t < 130.0 else 0.1)
    assert window.is_open
    assert window.trusted_s == pytest.approx(30.0 - 3.0, abs=0.5)


def test_a_receiver_that_repeats_its_last_fix_is_not_late():
    window = TrustWindow()
    events = listened(window, lambda t: max(0.0, t - 130.0))
    assert [e.reason for e in events if isinstance(e, WindowClosed)] == [Distrust.STALE]


@pytest.mark.parametrize("count", [1, 5, 60])
def test_what_a_line_has_held_back_closes_nothing_where_others_come_in_time(count):
    window = TrustWindow()
    listened(window, lambda _: 0.1, end=130.0)
    for k in range(count):
        assert window.feed(fix(100.0 + 0.2 * k)) == ()
    assert listened(window, lambda _: 0.1, start=130.0, end=150.0) == []
    assert window.is_open


def test_fixes_that_are_late_from_some_moment_on_are_told_as_that():
    window = TrustWindow()
    events = listened(window, lambda t: 0.1 if t < 130.0 else 20.0)
    assert [type(e) for e in events] == [WindowOpened, WindowClosed]
    assert window.reason is Distrust.LATE


@pytest.mark.parametrize("late", [70.0, 900.0])
def test_fixes_by_another_clock_are_told_as_late_and_not_as_none(late):
    calibrator = Calibrator()
    listened(calibrator, lambda _: late, start=1000.0, end=1020.0)
    assert calibrator.trust.reason is Distrust.LATE
    assert calibrator.trust.trusted_s == 0.0
