"""The trust window: one test per reason, its recovery, and invariants under anything at all."""

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.gps.distrust import Distrust, WindowClosed, WindowOpened
from onboard.core.gps.limits import RECOVERY, TrustLimits
from onboard.core.gps.trust import Phase, TrustWindow
from onboard.core.inputs.samples import (
    AttitudeSample,
    EkfHealth,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    VehicleState,
)
from tests.core.gps.fixes import STEP, fix, fly, opened

HEALTHY = 0b11_0011_1111  # all but terrain, not constant position


def test_waits_then_opens_on_the_first_good_fix_and_counts_trusted_time():
    window = TrustWindow()
    assert window.phase is Phase.WAITING
    assert window.feed(ImuSample(0.0, 1, (0, 0, -9.8))) == ()
    assert fly(window, 1.0, 11.0) == [WindowOpened(1.0)]
    assert window.is_open
    assert window.reason is None
    assert window.trusted_s == pytest.approx(10.0)
    assert window.rejected == {}


@pytest.mark.parametrize(
    ("reason", "bad"),
    [
        (Distrust.NO_FIX, {"fix_type": 1}),
        (Distrust.NO_FIX, {"v_n": math.nan}),
        (Distrust.NO_FIX, {"altitude": math.inf}),
        (Distrust.FEW_SATELLITES, {"satellites": 5}),
        (Distrust.HDOP, {"hdop": 3.0}),
        (Distrust.SPEED_ACCURACY, {"speed_accuracy": 6.0}),
    ],
)
def test_a_bad_fix_suspends_and_recovers_after_its_time(reason, bad):
    window = TrustWindow()
    fly(window, 0.0, 5.0)
    assert fly(window, 5.2, 6.2, **bad) == [WindowClosed(5.2, reason)]
    assert window.phase is Phase.SUSPENDED
    assert window.reason is reason
    again = opened(window, fly(window, 6.4, 20.0))
    assert again == pytest.approx(6.4 + RECOVERY[reason], abs=STEP)
    assert again >= 6.4 + RECOVERY[reason]
    assert window.trusted_s == pytest.approx(5.0 + 20.0 - again, abs=1e-6)
    assert window.rejected == {reason.value: 6 + round((again - 6.4) / STEP)}


@pytest.mark.parametrize(
    "unknown",
    [
        {"satellites": None},
        {"hdop": None},
        {"speed_accuracy": None},
        {"speed_accuracy": 0.0},
        {"v_d": None},
    ],
)
def test_absence_is_not_distrust(unknown):
    window = TrustWindow()
    assert fly(window, 0.0, 5.0, **unknown) == [WindowOpened(0.0)]


def test_a_value_at_its_limit_does_not_flap():
    window = TrustWindow()
    events = []
    for k in range(200):
        events += window.feed(fix(k * STEP, hdop=2.4 if k % 4 else 2.6))
    assert [type(e) for e in events].count(WindowOpened) == 0
    assert window.reason is Distrust.HDOP


@pytest.mark.parametrize(
    ("reason", "bad", "good"),
    [
        (Distrust.JAMMED, GpsIntegrity(5.1, True, False), GpsIntegrity(6.1, False, False)),
        (Distrust.SPOOFED, GpsIntegrity(5.1, False, True), GpsIntegrity(6.1, False, False)),
        (Distrust.EKF_GPS_GLITCH, EkfHealth(5.1, HEALTHY | 1 << 15), EkfHealth(6.1, HEALTHY)),
        (Distrust.EKF_UNHEALTHY, EkfHealth(5.1, HEALTHY & ~1), EkfHealth(6.1, HEALTHY)),
        (Distrust.EKF_UNHEALTHY, EkfHealth(5.1, HEALTHY | 1 << 10), EkfHealth(6.1, HEALTHY)),
        (Distrust.EKF_UNHEALTHY, EkfHealth(5.1, 0b1010_0111), EkfHealth(6.1, HEALTHY)),
    ],
)
def test_reports_of_the_autopilot_suspend_until_they_are_denied(reason, bad, good):
    window = TrustWindow()
    fly(window, 0.0, 5.0)
    assert window.feed(bad) == (WindowClosed(5.1, reason),)
    assert fly(window, 5.2, 6.0) == []  # good fixes alone do not mend it
    assert window.feed(good) == ()
    assert opened(window, fly(window, 6.2, 60.0)) == pytest.approx(6.1 + RECOVERY[reason], abs=STEP)


def test_navigation_flags_of_the_ekf_do_not_matter():
    window = TrustWindow()
    window.feed(EkfHealth(0.0, 0b1))  # attitude only
    assert fly(window, 0.2, 1.0) == [WindowOpened(0.2)]


def test_vehicle_state_does_not_gate():
    window = TrustWindow()
    window.feed(VehicleState(0.0, armed=False, landed=True))
    assert fly(window, 0.2, 1.0) == [WindowOpened(0.2)]


def test_the_gravest_of_several_reasons_is_named_and_all_are_listed():
    window = TrustWindow()
    fly(window, 0.0, 2.0)
    window.feed(fix(2.2, hdop=9.0, satellites=4))
    window.feed(GpsIntegrity(2.3, False, True))
    window.feed(fix(2.4))
    assert window.reason is Distrust.SPOOFED
    assert window.reasons == (Distrust.SPOOFED, Distrust.FEW_SATELLITES, Distrust.HDOP)


def test_a_gap_ends_the_trusted_span_at_the_last_fix_and_needs_no_recovery():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    assert window.feed(AttitudeSample(6.4, 0, 0, 0)) == ()
    assert window.feed(AttitudeSample(6.6, 0, 0, 0)) == (WindowClosed(4.0, Distrust.GPS_GAP),)
    assert fly(window, 9.0, 10.0) == [WindowOpened(9.0)]
    assert window.trusted_s == pytest.approx(5.0)


def test_a_gap_is_seen_from_the_fixes_alone():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    assert fly(window, 24.0, 25.0) == [WindowClosed(4.0, Distrust.GPS_GAP), WindowOpened(24.0)]


def test_a_receiver_that_repeats_its_last_fix_is_stale():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    events = []
    for k in range(1, 200):
        events += window.feed(ImuSample(4.0 + 0.02 * k, 1, (0, 0, -9.8)))
        if k % 10 == 0:
            events += window.feed(fix(4.0))
    assert events == [WindowClosed(4.0, Distrust.STALE)]
    assert opened(window, fly(window, 8.2, 20.0)) == pytest.approx(11.2, abs=STEP)


def test_repeats_between_fixes_are_neither_counted_nor_harmful():
    window = TrustWindow()
    for k in range(50):
        window.feed(fix(k * STEP))
        window.feed(fix(k * STEP))
    assert window.is_open
    assert window.trusted_s == pytest.approx(49 * STEP)
    assert window.rejected == {}


def test_a_moving_receiver_with_frozen_content_is_stale():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    events = fly(window, 4.2, 6.0, latitude=fix(4.0).latitude)
    assert events == [WindowClosed(pytest.approx(5.0, abs=STEP), Distrust.STALE)]


def test_a_resting_receiver_may_repeat_itself():
    window = TrustWindow()
    assert fly(window, 0.0, 20.0, latitude=0.9, v_n=0.0) == [WindowOpened(0.0)]


def test_late_fixes_are_refused_and_counted():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    assert window.feed(fix(3.5)) == ()
    assert window.rejected == {"stale": 1}
    assert fly(window, 4.2, 6.0) == []
    assert window.is_open


def test_a_link_that_repeats_and_reorders_does_not_touch_trust():
    """Every message twice, each delayed by itself by up to 0.8 s: the receiver is as it was."""
    rng = random.Random(7)
    sent = [(k * 0.1, fix(k // 2 * STEP)) for k in range(1200) for _ in range(2)]
    arriving = sorted(sent, key=lambda at: at[0] + rng.uniform(0.0, 0.8))
    window = TrustWindow()
    events = [event for _, sample in arriving for event in window.feed(sample)]
    assert [type(event) for event in events] == [WindowOpened]


def test_one_stamp_from_the_future_does_not_end_trust_for_good():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    window.feed(fix(1e6, latitude=0.82))
    fly(window, 4.2, 12.0)
    assert window.is_open


def test_velocity_that_jumps_is_a_glitch_and_real_manoeuvres_are_not():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    assert window.feed(fix(4.2, v_n=15.0)) == ()  # 25 m/s^2: a hard turn
    assert window.feed(fix(4.4, v_n=38.0)) == (WindowClosed(4.4, Distrust.GPS_GLITCH),)


@pytest.mark.parametrize(
    ("felt", "change", "believed"),
    [(9.8, 10.0, False), (70.0, 10.0, True), (70.0, 18.0, True), (70.0, 25.0, False)],
)
def test_no_velocity_jumps_that_changes_as_the_force_that_was_felt_can_change_it(
    felt, change, believed
):
    """An aerobatic plane pulls 7 g: 14 m/s from one fix to the next, and 2 by gravity."""
    asked = []
    window = TrustWindow(felt=lambda since: asked.append(since) or felt)
    fly(window, 0.0, 4.0, v_d=0.0)
    assert not asked
    window.feed(fix(4.2, v_d=change))
    assert window.is_open is believed
    # What a late fix tells of was felt before the fix before it.
    assert 4.0 - asked[0] > 0.5


@pytest.mark.parametrize(("felt", "believed"), [(9.8, False), (25.0, False), (90.0, True)])
def test_places_leave_a_velocity_that_swings_between_fixes_behind(felt, believed):
    """By 4 m/s, where 2.9 are granted to all, and 4.4 more to one that pulls 9 g."""
    window = TrustWindow(felt=lambda since: felt)
    fly(window, 0.0, 4.0)
    for k in range(1, 10):
        window.feed(fix(4.0 + k * STEP, longitude=0.14 + 4 * k * STEP / 4.35e6))
    assert window.is_open is believed


def test_vertical_jumps_count_where_there_is_a_vertical_speed():
    window = TrustWindow()
    fly(window, 0.0, 4.0, v_d=0.0)
    assert window.feed(fix(4.2, v_d=25.0)) == (WindowClosed(4.2, Distrust.GPS_GLITCH),)


def test_position_that_leaves_velocity_behind_is_a_glitch():
    window = TrustWindow()
    fly(window, 0.0, 4.0)
    events = []
    for k in range(1, 10):  # the position drifts east at 6 m/s, the velocity does not say so
        t = 4.0 + k * STEP
        events += window.feed(fix(t, longitude=0.14 + 6 * k * STEP / 4.35e6))
    assert [e.reason for e in events] == [Distrust.GPS_GLITCH]


def test_recordings_with_one_constant_position_are_judged_by_velocity_only():
    window = TrustWindow()
    events = []
    for k in range(50):
        events += window.feed(fix(k * STEP, latitude=0.0, longitude=0.0, v_e=0.1 * k))
    assert events == [WindowOpened(0.0)]


def test_the_configured_end_is_for_good():
    window = TrustWindow(TrustLimits(duration=10.0))
    events = fly(window, 3.0, 30.0)
    assert events == [WindowOpened(3.0), WindowClosed(pytest.approx(13.0), Distrust.CONFIGURED_END)]
    assert window.phase is Phase.ENDED
    assert window.reason is Distrust.CONFIGURED_END
    assert window.rejected == {}
    assert window.trusted_s == pytest.approx(10.0)


def test_the_configured_end_comes_also_while_suspended():
    window = TrustWindow(TrustLimits(duration=10.0))
    fly(window, 0.0, 8.0)
    fly(window, 8.2, 30.0, fix_type=2)
    assert window.phase is Phase.ENDED


def test_a_restart_closes_forgets_conditions_and_accepts_the_new_clock():
    window = TrustWindow()
    window.feed(EkfHealth(0.0, HEALTHY))
    fly(window, 100.0, 104.0)
    window.feed(GpsIntegrity(104.1, True, False))
    assert window.restart(104.1) == ()
    assert window.phase is Phase.WAITING
    assert fly(window, 1.0, 2.0) == [WindowOpened(1.0)]
    assert window.restart(2.0) == (WindowClosed(2.0, Distrust.RESTARTED),)
    assert window.trusted_s == pytest.approx(5.0)


def test_finish_closes_at_the_last_fix_once():
    window = TrustWindow()
    fly(window, 0.0, 3.0)
    assert window.finish() == (WindowClosed(3.0, Distrust.END_OF_DATA),)
    assert window.finish() == ()
    assert window.feed(fix(4.0)) == ()
    assert TrustWindow().finish() == ()


number = st.one_of(st.floats(), st.floats(-20, 20))
anything = st.one_of(
    st.builds(
        GpsFix,
        t=st.one_of(st.floats(0, 60), number),
        receiver=st.just(1),
        fix_type=st.integers(0, 6),
        latitude=number,
        longitude=number,
        altitude=number,
        v_n=number,
        v_e=number,
        v_d=st.none() | number,
        satellites=st.none() | st.integers(0, 30),
        hdop=st.none() | number,
        speed_accuracy=st.none() | number,
    ),
    st.builds(fix, st.floats(0, 60)),
    st.builds(ImuSample, number, st.just(1), st.just((0.0, 0.0, -9.8))),
    st.builds(EkfHealth, number, st.sampled_from([HEALTHY, 0, HEALTHY | 1 << 15])),
    st.builds(GpsIntegrity, st.floats(0, 60), st.booleans(), st.booleans()),
    st.none(),  # a reboot
)


@pytest.mark.slow
@settings(max_examples=200)
@given(st.lists(anything, max_size=60))
def test_invariants_under_anything(inputs):
    """Never raises; openings and closings alternate; every refusal and second is accounted for."""
    window = TrustWindow(TrustLimits(duration=40.0))
    is_open = False
    for item in inputs:
        before = sum(window.rejected.values())
        events = window.restart(0.0) if item is None else window.feed(item)
        for event in events:
            assert isinstance(event, WindowOpened) is not is_open
            is_open = isinstance(event, WindowOpened)
        assert window.is_open is is_open
        assert (window.reason is None) or not is_open
        assert sum(window.rejected.values()) - before in (0, 1)
        assert 0 <= window.trusted_s < math.inf
        if is_open:
            assert window.reasons == ()
    assert isinstance(window.finish(), tuple)
    assert not window.is_open
