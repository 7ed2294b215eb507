"""What has lain somewhere on its way is behind; a slow clock, and one that began anew, are not."""

import pytest

from onboard.mavlink.bootclock import BootClock
from onboard.mavlink.dialect import mavlink


def heard(clock, boot_s, now):
    clock.observe(mavlink.MAVLink_attitude_message(round(1e3 * boot_s), 0, 0, 0, 0, 0, 0), now)
    return clock.lateness.seconds


def steady(clock, *, begins=100.0, seconds=20.0, delay=0.1, pace=1.0):
    """A stream of 10 Hz; the largest lateness in it."""
    return max(
        heard(clock, begins + pace * i / 10, begins + i / 10 + delay)
        for i in range(round(10 * seconds))
    )


def test_an_even_stream_is_never_late():
    assert steady(BootClock()) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("held_s", [2.0, 4.0, 20.0])
def test_what_was_held_back_is_late_by_as_much_as_it_waited(held_s):
    """It comes at once, in its order; the newest of it has hardly waited."""
    clock, end = BootClock(), 120.0
    steady(clock)
    times = [end + i / 10 for i in range(round(10 * held_s) + 1)]
    found = [heard(clock, t, end + held_s + 0.1 + 1e-4 * i) for i, t in enumerate(times)]
    assert found == pytest.approx([end + held_s - t for t in times], abs=0.15)


def test_a_packet_that_was_overtaken_makes_nothing_late():
    clock = BootClock()
    steady(clock)
    heard(clock, 120.0, 120.1)
    assert heard(clock, 118.0, 120.11) == pytest.approx(0.0, abs=0.02)


def test_a_line_that_has_become_slower_is_late_for_some_seconds_only():
    clock = BootClock()
    steady(clock)
    assert steady(clock, begins=120.0, seconds=0.2, delay=2.0) == pytest.approx(1.85, abs=0.1)
    steady(clock, begins=121.0, seconds=6.0, delay=2.0)
    assert heard(clock, 128.0, 130.0) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("pace", [0.7, 6.0])
def test_a_simulator_that_is_slower_or_faster_than_time_is_not_late(pace):
    assert steady(BootClock(), seconds=100.0, pace=pace) == pytest.approx(0.0, abs=0.02)


def test_a_clock_that_has_begun_anew_is_not_late():
    clock = BootClock()
    steady(clock)
    for i in range(5):
        heard(clock, 1.0 + i / 10, 121.0 + i / 10)
    assert clock.reboots == 1
    assert clock.lateness.seconds == pytest.approx(0.0, abs=0.02)
