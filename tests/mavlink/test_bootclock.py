from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.mavlink.bootclock import WRAP_S, BootClock

WRAP_MS = 2**32
UNIX_US = 1_700_000_000_000_000


@given(st.integers(0, WRAP_MS - 1), st.lists(st.integers(0, 500_000), min_size=1, max_size=200))
def test_the_32_bit_wrap_is_invisible(start, steps):
    clock = BootClock()
    clock.from_ms(start)
    now = start
    for step in steps:
        now += step
        assert clock.from_ms(now % WRAP_MS) == pytest.approx(now * 1e-3, abs=1e-5)
    assert clock.reboots == 0


def test_a_late_packet_from_before_the_wrap_stays_before_it():
    clock = BootClock()
    for ms in (WRAP_MS - 40, WRAP_MS - 20, 0):
        clock.from_ms(ms % WRAP_MS)
    assert clock.from_ms(WRAP_MS - 10) == pytest.approx(WRAP_S - 0.01)
    assert clock.latest == pytest.approx(WRAP_S)
    assert clock.reboots == 0


def test_a_64_bit_stamp_tells_how_often_the_32_bits_wrapped():
    clock = BootClock()
    clock.from_us(round(3 * WRAP_S * 1e6) + 5_000_000)
    assert clock.from_ms(5010) == pytest.approx(3 * WRAP_S + 5.010)
    assert clock.reboots == 0


@pytest.mark.parametrize("uptime", [10.0, 3600.0, WRAP_S + 5000.0])
def test_a_reboot_is_noticed_and_time_starts_again(uptime):
    clock = BootClock()
    clock.from_us(round(uptime * 1e6))
    for ms in (500, 520, 540):
        t = clock.from_ms(ms)
    assert clock.reboots == 1
    assert t == clock.latest == pytest.approx(0.54)


def test_one_stray_packet_is_not_a_reboot():
    clock = BootClock()
    for ms in (100_000, 100_020, 90_000, 100_040, 90_020, 100_060):
        clock.from_ms(ms)
    assert clock.reboots == 0
    assert clock.latest == pytest.approx(100.06)


@given(st.permutations(range(0, 1000, 20)))
def test_reordering_within_seconds_is_not_a_reboot(order):
    clock = BootClock()
    for ms in order:
        assert clock.from_ms(5000 + ms) == pytest.approx((5000 + ms) * 1e-3)
    assert clock.reboots == 0
    assert clock.latest == pytest.approx(5.98)


def test_unix_stamps_are_put_on_the_boot_clock_by_system_time():
    clock = BootClock()
    clock.pair(UNIX_US, 60_000)
    assert clock.from_us(UNIX_US + 1_500_000) == pytest.approx(61.5)
    assert clock.reboots == 0


def test_without_system_time_the_last_stamp_heard_has_to_do():
    clock = BootClock()
    clock.from_ms(60_000)
    assert clock.from_us(UNIX_US) == pytest.approx(60.0)
    clock.from_ms(60_020)
    assert clock.from_us(UNIX_US + 20_000) == pytest.approx(60.02, abs=1e-6)


def test_a_step_of_the_autopilots_unix_clock_is_followed():
    clock = BootClock()
    clock.from_ms(60_000)
    clock.from_us(UNIX_US)
    clock.from_ms(61_000)
    assert clock.from_us(UNIX_US + 3_600_000_000) == pytest.approx(61.0)


def test_a_reboot_is_noticed_under_unix_stamps_too():
    clock = BootClock()
    clock.pair(UNIX_US, 600_000)
    for i in range(5):
        clock.from_us(UNIX_US + 5_000_000 + i * 20_000)
        clock.from_ms(300 + i * 20)
    assert clock.reboots == 1
    assert clock.latest == pytest.approx(0.38, abs=0.03)
