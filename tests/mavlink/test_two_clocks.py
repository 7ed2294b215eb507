"""Two autopilots that tell no unique id, and all that looks like two and is one."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.mavlink.bootclock import WRAP_S, BootClock
from onboard.mavlink.twofold import Twofold

RATE = 20.0


class Line:
    """What arrives: stamps by the time of their arrival."""

    def __init__(self):
        self.packets = []

    def autopilot(self, boot, begin, end, *, delay=lambda: 0.02, rate=1.0, repeated=1):
        """One whose clock says ``boot`` at ``begin``, heard until ``end`` (ours, s)."""
        for i in range(int((end - begin) * RATE)):
            sent = begin + i / RATE
            stamp = boot + rate * (sent - begin)
            self.packets += [(sent + delay(), stamp) for _ in range(repeated)]
        return self

    def heard(self, clock=None):
        clock = clock or BootClock()
        for now, stamp in sorted(self.packets):
            ms = int(1e3 * stamp) % 2**32
            clock.observe(mavlink.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0), now)
        return clock


def two(clock, now):
    return clock.other.goes_on(now)


@pytest.mark.parametrize("apart", [4.0, 40.0, -40.0, 3e5])
def test_two_clocks_that_go_on_are_two_and_no_reboots(apart):
    line = Line().autopilot(4e5, 0.0, 60.0).autopilot(4e5 + apart, 10.03, 60.0)
    clock = line.heard()
    assert two(clock, 60.0)
    assert clock.reboots <= 1
    assert not two(clock, 200.0), "one of them has gone"


@pytest.mark.parametrize("lost", [0.0, 0.3, 0.7])
def test_they_are_noticed_within_half_a_minute_whatever_is_lost(lost):
    for seed in range(20):
        chance = random.Random(seed)
        line = Line().autopilot(900.0, 0.0, 40.0).autopilot(100.0, 10.0, 40.0)
        line.packets = [packet for packet in line.packets if chance.random() >= lost]
        clock = line.heard()
        assert two(clock, 40.0)
        assert clock.reboots <= 3


def late(seed, longest, share):
    chance = random.Random(seed)
    return lambda: 0.02 + (longest * chance.random() if chance.random() < share else 0.0)


ONE = {
    "a reboot": lambda: Line().autopilot(1000.0, 0.0, 30.0).autopilot(0.5, 33.0, 90.0),
    "a reboot at once": lambda: Line().autopilot(1000.0, 0.0, 30.0).autopilot(0.5, 30.0, 90.0),
    "a reboot after a short life": lambda: (
        Line().autopilot(0.5, 0.0, 8.0).autopilot(0.5, 10.0, 90.0)
    ),
    "reboots in a row": lambda: (
        Line()
        .autopilot(500.0, 0.0, 10.0)
        .autopilot(0.5, 12.0, 20.0)
        .autopilot(0.5, 22.0, 25.0)
        .autopilot(0.5, 27.0, 90.0)
    ),
    "a reboot with packets of before on their way": lambda: (
        Line()
        .autopilot(1000.0, 0.0, 30.0, delay=late(1, 2.9, 0.5))
        .autopilot(0.5, 30.5, 90.0, delay=late(2, 2.9, 0.5))
    ),
    "reordered": lambda: Line().autopilot(1000.0, 0.0, 90.0, delay=late(3, 2.9, 0.5)),
    "twice by two ways": lambda: (
        Line()
        .autopilot(1000.0, 0.0, 90.0, repeated=2)
        .autopilot(1000.0, 0.0, 90.0, delay=lambda: 2.5)
    ),
    "a silence": lambda: Line().autopilot(1000.0, 0.0, 30.0).autopilot(1060.0, 60.0, 90.0),
    "a reboot in a silence": lambda: Line().autopilot(20.0, 0.0, 30.0).autopilot(25.0, 60.0, 90.0),
    "the clock's 32 bits": lambda: Line().autopilot(WRAP_S - 30.0, 0.0, 90.0),
    "a simulator in a hurry": lambda: (
        Line().autopilot(1000.0, 0.0, 30.0, rate=10.0).autopilot(0.5, 33.0, 90.0, rate=10.0)
    ),
    "a simulator that takes its time": lambda: (
        Line().autopilot(1000.0, 0.0, 30.0, rate=0.2).autopilot(0.5, 33.0, 90.0, rate=0.2)
    ),
}


@pytest.mark.parametrize("name", ONE)
def test_one_is_one(name):
    clock = ONE[name]().heard()
    assert not two(clock, 90.0)
    assert clock.latest == pytest.approx(max(s for t, s in ONE[name]().packets if t > 80.0), abs=3)


def burst(line, at, late, count=40):
    """Packets of one autopilot that come this late, together with those of now."""
    line.packets += [(at + i / RATE, 1000.0 + at + i / RATE - late) for i in range(count)]
    return line


@pytest.mark.parametrize("late", [4.0, 6.0, 20.0])
def test_packets_that_come_later_than_a_link_delays_them_are_no_second_one(late):
    line = Line().autopilot(1000.0, 0.0, 120.0)
    for at in (30.0, 33.5, 50.0, 52.0, 90.0):
        burst(line, at, late)
    clock = line.heard()
    assert not two(clock, 120.0)
    assert clock.latest == pytest.approx(1120.0, abs=0.2)
    assert clock.certain(120.0)


@pytest.mark.parametrize("count", [2, 3])
def test_what_was_taken_for_a_reboot_is_over_in_seconds(count):
    line = Line().autopilot(1000.0, 0.0, 33.0)
    late = [(30.01 + i / 1000, 1020.0 + i / 1000) for i in range(count)]
    line.packets += late
    clock = line.heard()
    assert clock.latest == pytest.approx(1033.0, abs=0.2)
    assert clock.certain(33.0)
    assert clock.reboots <= 1


@pytest.mark.parametrize("count", [2, 40])
@pytest.mark.parametrize("late", [4.0, 20.0, 600.0])
def test_what_a_line_has_held_back_is_no_reboot_while_the_clock_goes_on(late, count):
    """A boot of 20 s ago does not fit between two stamps that came in one second."""
    line = Line().autopilot(1000.0, 0.0, 40.0)
    clock = burst(line, 30.0, late, count).heard()
    assert clock.reboots == 0
    assert not clock.doubts(1040.0)
    assert clock.doubts(1040.0 - late)


@pytest.mark.parametrize("rate", [1.0, 20.0])
@pytest.mark.parametrize("silence", [0.05, 1.0, 5.0])
def test_a_reboot_is_told_in_seconds_and_nothing_of_it_is_mixed_with_before(silence, rate):
    booted = 30.0 + silence
    line = Line().autopilot(50_000.0, 0.0, 30.0, rate=rate)
    line.autopilot(0.5, booted, 60.0, rate=rate)
    clock, told = BootClock(), None
    for now, stamp in sorted(line.packets):
        before = clock.reboots
        ms = mavlink.MAVLink_attitude_message(int(1e3 * stamp), 0, 0, 0, 0, 0, 0)
        clock.observe(ms, now)
        told = now if clock.reboots > before else told
        assert clock.doubts(stamp) == (stamp < 49_000.0 and told is None)
    assert clock.reboots == 1
    assert told < max(booted + 0.2, 30.0 + 1.7)


def test_one_of_two_that_goes_leaves_the_other():
    for first, second in ((900.0, 100.0), (100.0, 900.0)):
        line = Line().autopilot(first, 0.0, 40.0).autopilot(second, 10.0, 80.0)
        clock = line.heard()
        assert clock.latest == pytest.approx(second + 70.0, abs=0.2)
        assert clock.certain(80.0)


def test_packets_of_before_a_reboot_that_come_late_are_no_second_one():
    line = Line().autopilot(1000.0, 0.0, 30.0).autopilot(0.5, 30.5, 60.0)
    line.packets += [(31.5, 1029.7), (31.6, 1029.8), (31.7, 1029.9)]
    assert line.heard().reboots == 1


class TestValues:
    @staticmethod
    def heard(*words, name="INS_GYROFFS_X"):
        twofold = Twofold()
        for now, value in words:
            twofold.take(name, value, now)
        return twofold.goes_on(words[-1][0])

    def test_two_answers_to_each_question_are_two_autopilots(self):
        rounds = [
            (30.0 * n + lag, value) for n in range(3) for lag, value in ((0.1, 1.0), (0.2, 2))
        ]
        assert self.heard(*rounds)
        assert self.heard(*rounds[:4])
        swapped = [(0.1, 1.0), (0.2, 2.0), (30.1, 2.0), (30.2, 1.0), (60.1, 1.0), (60.2, 2.0)]
        assert self.heard(*swapped)

    @pytest.mark.parametrize(
        "words",
        [
            [(0.0, 1.0), (30.0, 1.0), (60.0, 1.0)],
            [(0.0, 1.0), (30.0, 2.0), (60.0, 2.0)],  # measured anew
            [(0.0, 1.0), (30.0, 2.0), (32.9, 1.0), (32.95, 2.0)],  # and the old one comes late
            [(0.0, 1.0), (30.0, 2.0), (60.0, 1.0)],  # a file is loaded
            [(0.0, 1.0), (30.0, 2.0), (60.0, 1.0), (90.0, 3.0), (120.0, 1.0)],
            [(0.0, 1.0), (30.0, 2.0), (150.0, 1.0), (300.0, 2.0)],  # somebody tries, for minutes
        ],
    )
    def test_one_autopilot_has_one_value_at_a_time(self, words):
        assert not self.heard(*words)

    def test_what_people_set_and_we_write_tells_nothing(self):
        words = [(30.0 * n + lag, value) for n in range(3) for lag, value in ((0.1, 1.0), (0.2, 2))]
        assert not self.heard(*words, name="INS_ACCOFFS_X")
