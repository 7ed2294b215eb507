from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.estimate.calibrator import Calibrator, Restarted
from onboard.core.inputs.samples import ImuSample
from onboard.mavlink.bootclock import WRAP_S, BootClock
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import mavlink

WRAP_MS = 2**32
UNIX_US = 1_700_000_000_000_000


def heard_ms(clock, ms):
    clock.observe(mavlink.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0))
    return clock.seconds_ms(ms)


def heard_us(clock, us):
    clock.observe(mavlink.MAVLink_raw_imu_message(us, *range(9)))
    return clock.seconds_us(us)


def heard_both(clock, unix_us, ms):
    clock.observe(mavlink.MAVLink_system_time_message(unix_us, ms))


@given(
    st.integers(0, WRAP_MS - 1) | st.integers(WRAP_MS - 1_000_000, WRAP_MS - 1),
    st.lists(st.integers(0, 500_000), min_size=1, max_size=200),
)
def test_the_32_bit_wrap_is_invisible(start, steps):
    clock = BootClock()
    heard_ms(clock, start)
    now = start
    for step in steps:
        now += step
        assert heard_ms(clock, now % WRAP_MS) == pytest.approx(now * 1e-3, rel=0.0, abs=1e-5)
    assert clock.reboots == 0


def test_a_late_packet_from_before_the_wrap_stays_before_it():
    clock = BootClock()
    for ms in (WRAP_MS - 40, WRAP_MS - 20, 0):
        heard_ms(clock, ms % WRAP_MS)
    assert heard_ms(clock, WRAP_MS - 10) == pytest.approx(WRAP_S - 0.01, rel=0.0, abs=1e-5)
    assert clock.latest == pytest.approx(WRAP_S, rel=0.0, abs=1e-5)
    assert clock.reboots == 0


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_the_moment_of_the_wrap_is_found_again_in_any_turn(turns):
    clock = BootClock()
    heard_us(clock, round(turns * WRAP_S * 1e6) - 20_000)
    for ms in (0, 20, 40):
        told = heard_ms(clock, ms)
        assert told == pytest.approx(turns * WRAP_S + ms * 1e-3, rel=0.0, abs=1e-4)
    assert clock.reboots == 0


def test_a_64_bit_stamp_tells_how_often_the_32_bits_wrapped():
    clock = BootClock()
    heard_us(clock, round(3 * WRAP_S * 1e6) + 5_000_000)
    assert heard_ms(clock, 5010) == pytest.approx(3 * WRAP_S + 5.010, rel=0.0, abs=1e-4)
    assert clock.reboots == 0


@pytest.mark.parametrize("uptime", [10.0, 3600.0, WRAP_S + 5000.0])
def test_a_reboot_is_noticed_and_time_starts_again(uptime):
    clock = BootClock()
    heard_us(clock, round(uptime * 1e6))
    for ms in (500, 520, 540):
        t = heard_ms(clock, ms)
    assert clock.reboots == 1
    assert t == clock.latest == pytest.approx(0.54)


def test_one_stray_packet_is_not_a_reboot():
    clock = BootClock()
    for ms in (100_000, 100_020, 90_000, 100_040, 90_020, 100_060):
        heard_ms(clock, ms)
    assert clock.reboots == 0
    assert clock.latest == pytest.approx(100.06)


def told(clock, kind, ms, now=None):
    message = {
        "ATTITUDE": lambda: mavlink.MAVLink_attitude_message(ms, 0, 0, 0, 0, 0, 0),
        "RAW_IMU": lambda: mavlink.MAVLink_raw_imu_message(1000 * ms, *range(9)),
        "SYSTEM_TIME": lambda: mavlink.MAVLink_system_time_message(UNIX_US + 1000 * ms, ms),
    }[kind]()
    return clock.observe(message, now)


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("kind", ["ATTITUDE", "RAW_IMU", "SYSTEM_TIME"])
@pytest.mark.parametrize("off", [3_600_000, 30_000, -20_000, -3_600_000])
@pytest.mark.parametrize("times", [1, 3])
def test_one_stray_stamp_is_no_reboot_however_often_it_is_repeated(kind, off, times, live):
    clock = BootClock()
    for k in range(500):
        now = 10.0 + 0.02 * k if live else None
        true = 5_000_000 + 20 * k
        told(clock, "ATTITUDE", true, now)
        for _ in range(times if k == 250 else 0):
            told(clock, kind, true + off, now)
            assert clock.latest == pytest.approx(true * 1e-3), "nothing is stamped by it"
        assert clock.seconds_us(UNIX_US + 1000 * true) == pytest.approx(true * 1e-3, abs=0.03)
    assert clock.reboots == 0
    assert not live or (clock.certain(now) and not clock.other.goes_on(now))


@pytest.mark.parametrize("leap", [12.0, 3600.0])
@pytest.mark.parametrize("every_s", [0.02, 1.0, 15.0])
def test_a_clock_that_has_gone_on_unheard_is_followed_from_its_second_stamp_on(leap, every_s):
    clock = BootClock()
    for k in range(100):
        heard_ms(clock, 100_000 + 20 * k)
    since = 102.0 + leap
    for k in range(5):
        heard_ms(clock, round(1e3 * (since + k * every_s)))
        newest = since + k * every_s
        assert clock.latest >= newest - (every_s if k else newest), "one stamp behind at most"
    assert clock.reboots == 0


def test_a_stray_stamp_before_a_reboot_hides_nothing_of_it():
    clock = BootClock()
    for ms in (600_000, 600_020, 4_000_000, 500, 520):
        heard_ms(clock, ms)
    assert (clock.reboots, clock.latest) == (1, 0.52)


@given(st.permutations(range(0, 1000, 20)))
def test_reordering_within_seconds_is_not_a_reboot(order):
    clock = BootClock()
    for ms in order:
        assert heard_ms(clock, 5000 + ms) == pytest.approx((5000 + ms) * 1e-3)
    assert clock.reboots == 0
    assert clock.latest == pytest.approx(5.98)


def test_unix_stamps_are_put_on_the_boot_clock_by_system_time():
    clock = BootClock()
    heard_both(clock, UNIX_US, 60_000)
    assert heard_us(clock, UNIX_US + 1_500_000) == pytest.approx(61.5)
    assert clock.reboots == 0


def test_without_system_time_the_last_stamp_heard_has_to_do():
    clock = BootClock()
    heard_ms(clock, 60_000)
    assert heard_us(clock, UNIX_US) == pytest.approx(60.0)
    heard_ms(clock, 60_020)
    assert heard_us(clock, UNIX_US + 20_000) == pytest.approx(60.02, abs=1e-6)


def test_a_step_of_the_autopilots_unix_clock_is_followed():
    clock = BootClock()
    heard_ms(clock, 60_000)
    heard_us(clock, UNIX_US)
    heard_ms(clock, 61_000)
    assert heard_us(clock, UNIX_US + 3_600_000_000) == pytest.approx(61.0)


def test_a_reboot_is_noticed_under_unix_stamps_too():
    clock = BootClock()
    heard_both(clock, UNIX_US, 600_000)
    for i in range(5):
        heard_us(clock, UNIX_US + 5_000_000 + i * 20_000)
        heard_ms(clock, 300 + i * 20)
    assert clock.reboots == 1
    assert clock.latest == pytest.approx(0.38, abs=0.03)


STAMPS = st.lists(
    st.one_of(
        st.integers(0, WRAP_MS - 1).map(lambda ms: ("ms", ms)),
        st.integers(0, 3 * WRAP_MS).map(lambda ms: ("us", ms * 1000)),
        st.integers(0, 10**9).map(lambda us: ("us", UNIX_US + us)),
    ),
    max_size=30,
)


@given(STAMPS)
def test_asking_the_clock_again_says_the_same_and_changes_nothing(stamps):
    clock = BootClock()
    for kind, stamp in stamps:
        first = heard_ms(clock, stamp) if kind == "ms" else heard_us(clock, stamp)
        latest, reboots = clock.latest, clock.reboots
        again = clock.seconds_ms(stamp) if kind == "ms" else clock.seconds_us(stamp)
        assert again == first
        assert (clock.latest, clock.reboots) == (latest, reboots)


@given(
    before=st.lists(st.integers(0, 40_000), max_size=4),
    stamps=st.lists(st.integers(0, 40_000), min_size=1, max_size=6),
    after=st.lists(st.integers(0, 40_000), max_size=4),
)
def test_stamps_that_only_advance_may_be_told_at_once(before, stamps, after):
    alone, together = BootClock(), BootClock()
    for ms in before:
        assert heard_ms(alone, ms) == heard_ms(together, ms)
    t = np.array(stamps, np.float64) * 1e-3
    at_once = together.only_advances(t)
    if at_once:
        together.advance(float(t.max()))
    for k, ms in enumerate(stamps):
        assert heard_ms(alone, ms) == t[k]
        if not at_once:
            heard_ms(together, ms)
    for ms in after:
        assert heard_ms(alone, ms) == heard_ms(together, ms)
    assert (alone.latest, alone.reboots) == (together.latest, together.reboots)


def test_a_stray_stamp_is_forgotten_by_stamps_told_at_once():
    clock = BootClock()
    for ms in (40_000, 5_000):
        heard_ms(clock, ms)
    assert clock.only_advances(np.array([40.02, 40.04]))
    clock.advance(40.04)
    heard_ms(clock, 5_000)
    assert (clock.latest, clock.reboots) == (40.04, 0)
    assert not clock.only_advances(np.array([40.06, 37.0]))
    assert not clock.only_advances(np.array([WRAP_S - 1.0]))


def test_a_decoder_with_the_links_clock_takes_its_time_and_does_not_move_it():
    clock = BootClock()
    decoder = Decoder(1, 1, clock=clock)
    message = mavlink.MAVLink_attitude_message(5000, 0, 0, 0, 0, 0, 0)
    message.get_srcSystem = message.get_srcComponent = lambda: 1
    (sample,) = decoder.decode(message)
    assert sample.t == 5.0
    assert clock.latest is None  # the link tells it, and only once


@pytest.mark.parametrize("back", [0.5, 1.5, 2.9, 3.1, 60.0])
def test_link_and_estimator_agree_on_what_a_reboot_is(back):
    clock, calibrator = BootClock(), Calibrator()
    restarted = False
    for t in (100.0, 100.02, 100.02 - back, 100.04 - back):
        heard_us(clock, round(t * 1e6))
        events = calibrator.feed(ImuSample(t, 1, (0.0, 0.0, -9.8), (0.0, 0.0, 0.0)))
        restarted |= any(isinstance(event, Restarted) for event in events)
    assert restarted == bool(clock.reboots)


def listened(clock, boot, heard):
    """Attitude five times a second: booted ``boot(now)`` s ago, for each ``now`` of ``heard``."""
    for now in heard:
        message = mavlink.MAVLink_attitude_message(round(1e3 * boot(now)), 0, 0, 0, 0, 0, 0)
        clock.observe(message, now)


def every(begin, end):
    return np.arange(begin, end, 0.2).tolist()


@pytest.mark.parametrize("silence", [6.0, 60.0, 3000.0])
@pytest.mark.parametrize("late", [0.0, 2.0])
def test_a_reboot_in_a_silence_that_outlasts_the_boot_before_it_is_found(silence, late):
    """Its clock is further on than ever, and yet behind ours."""
    clock, back = BootClock(), 50.0 + silence
    listened(clock, lambda now: now - 45.0, every(46.0, 50.0))
    booted = 50.0 + (0.1 if silence > 10.0 else 0.5)
    assert clock.certain(50.0)
    assert not clock.certain(back)
    listened(clock, lambda now: now - booted - late, every(back, back + 2.0))
    assert clock.reboots == 0, "what was held back may still come"
    assert not clock.certain(back + 2.0)
    listened(clock, lambda now: now - booted - late, every(back + 2.0, back + 20.0))
    assert (clock.reboots, clock.unseen) == (1, True)
    assert clock.certain(back + 20.0)


def test_a_silence_without_a_reboot_is_none():
    clock = BootClock()
    listened(clock, lambda now: now, every(100.0, 110.0))
    listened(clock, lambda now: now - 2.0, every(200.0, 200.5))
    assert clock.certain(200.5)
    listened(clock, lambda now: now, every(200.5, 300.0))
    assert clock.reboots == 0


def test_what_a_link_has_held_back_is_no_reboot():
    """A TCP line that stalls for 20 s gives everything at once; a slow one within some seconds."""
    clock = BootClock()
    listened(clock, lambda now: now, every(100.0, 110.0))
    held = every(110.0, 130.0)
    for k, sent in enumerate(held):
        listened(clock, lambda _, sent=sent: sent, [130.0 + 2.0 * k / len(held)])
    listened(clock, lambda now: now, every(132.0, 160.0))
    assert clock.reboots == 0
    assert clock.certain(160.0)


@pytest.mark.parametrize("faster", [2.0, 3.0])
def test_a_line_that_takes_long_to_give_what_it_held_back_is_no_reboot(faster):
    clock, stalled, back = BootClock(), 110.0, 130.0
    listened(clock, lambda now: now, every(100.0, stalled))
    listened(clock, lambda now: min(now, stalled + faster * (now - back)), every(back, 170.0))
    assert clock.reboots == 0
    assert clock.certain(170.0)


def test_stamps_of_unix_time_tell_of_no_reboot_in_a_silence():
    clock = BootClock()
    for now in (*every(100.0, 110.0), *every(200.0, 220.0)):
        stamp = round(1e6 * (1.7e9 + now))
        clock.observe(mavlink.MAVLink_raw_imu_message(stamp, *[0] * 9), now)
    assert clock.reboots == 0


def test_a_reboot_that_is_seen_is_counted_once():
    clock = BootClock()
    listened(clock, lambda now: now, every(100.0, 110.0))
    listened(clock, lambda now: now - 114.0, every(115.0, 140.0))
    assert (clock.reboots, clock.unseen) == (1, False)
    assert clock.certain(140.0)
