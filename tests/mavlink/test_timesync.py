from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.mavlink.dialect import mavlink
from onboard.mavlink.timesync import TimeSync
from tests.mavlink.mavlink_peer import received


class Exchange:
    """A TimeSync and an autopilot whose boot clock is ``local * rate + offset``."""

    def __init__(self, offset=-1000.0, rate=1.0) -> None:
        self.offset, self.rate = offset, rate
        self.sync = TimeSync()
        self.now = 5000.0
        self.sync.start(1, 1, self.now)

    def boot(self, local):
        return local * self.rate + self.offset

    def round(self, there=0.002, back=0.002, *, answered=True):
        """One request and its answer after the given delays."""
        for request in self.sync.poll(self.now):
            if answered:
                tc1 = round(self.boot(self.now + there) * 1e9)
                answer = received(mavlink.MAVLink_timesync_message(tc1, request.ts1))
                self.sync.feed(answer, self.now + there + back)
        self.now += 1.0


@given(
    st.floats(-4999.0, 1e5),
    st.lists(st.tuples(st.floats(0.0005, 0.5), st.floats(0.0005, 0.5)), min_size=3, max_size=40),
)
def test_the_offset_is_right_to_half_the_best_round_trip(offset, delays):
    exchange = Exchange(offset)
    for there, back in delays:
        exchange.round(there, back)
    error = exchange.sync.offset - offset
    assert abs(error) <= exchange.sync.uncertainty(exchange.now) + 1e-6
    best = min(there + back for there, back in delays[-30:])
    assert exchange.sync.uncertainty(exchange.now) <= best / 2 + 100e-6 * 35


def test_it_converts_both_ways():
    exchange = Exchange()
    assert exchange.sync.to_boot(5000.0) is None
    assert exchange.sync.to_local(4000.0) is None
    assert exchange.sync.uncertainty(5000.0) is None
    exchange.round()
    assert exchange.sync.to_boot(5003.0) == pytest.approx(4003.0, abs=0.002)
    assert exchange.sync.to_local(exchange.sync.to_boot(5003.0)) == pytest.approx(5003.0)


def test_a_drifting_crystal_is_followed():
    exchange = Exchange(rate=1.0 + 50e-6)
    rng = random.Random(4)
    for _ in range(1000):
        exchange.round(0.001 + rng.expovariate(500.0), 0.001 + rng.expovariate(500.0))
    assert exchange.sync.to_boot(exchange.now) == pytest.approx(
        exchange.boot(exchange.now), abs=0.004
    )
    assert exchange.sync.steps == 0


def test_one_answer_that_contradicts_is_an_outlier_and_three_are_a_step():
    exchange = Exchange()
    for _ in range(10):
        exchange.round()
    exchange.offset += 5.0
    exchange.round()
    assert (exchange.sync.rejected, exchange.sync.steps) == (1, 0)
    assert exchange.sync.offset == pytest.approx(-1000.0, abs=0.002)
    exchange.round()
    exchange.round()
    assert exchange.sync.steps == 1
    assert exchange.sync.offset == pytest.approx(-995.0, abs=0.002)


def test_a_reboot_makes_it_start_again():
    exchange = Exchange()
    exchange.round()
    exchange.offset = -exchange.now
    exchange.sync.start(1, 1, exchange.now)
    assert exchange.sync.offset is None
    exchange.round()
    assert exchange.sync.to_boot(exchange.now) == pytest.approx(1.0, abs=0.002)


def test_repeated_foreign_and_invented_answers_are_ignored():
    exchange = Exchange()
    (request,) = exchange.sync.poll(exchange.now)
    good = mavlink.MAVLink_timesync_message(round(4000.001e9), request.ts1)
    later = exchange.now + 0.002
    exchange.sync.feed(received(mavlink.MAVLink_timesync_message(0, 77)), later)
    exchange.sync.feed(received(mavlink.MAVLink_timesync_message(5, request.ts1 + 1)), later)
    exchange.sync.feed(received(good, system=9), later)
    assert exchange.sync.offset is None
    exchange.sync.feed(received(good), later)
    offset = exchange.sync.offset
    exchange.sync.feed(received(good), later + 1.0)
    assert exchange.sync.offset == offset == pytest.approx(-1000.0, abs=0.001)


def test_lost_answers_leave_nothing_behind():
    exchange = Exchange()
    for _ in range(200):
        exchange.round(answered=False)
    assert exchange.sync.offset is None
    assert len(exchange.sync._pending) <= 3


def test_it_asks_fast_at_first_and_then_once_a_second():
    exchange = Exchange()
    asked = []
    for tick in range(200):
        now = exchange.now + tick * 0.1
        for request in exchange.sync.poll(now):
            asked.append(tick)
            tc1 = round(exchange.boot(now + 0.001) * 1e9)
            exchange.sync.feed(
                received(mavlink.MAVLink_timesync_message(tc1, request.ts1)), now + 0.002
            )
    assert len([tick for tick in asked if tick < 10]) >= 8
    assert 9 <= len([tick for tick in asked if tick >= 100]) <= 11
