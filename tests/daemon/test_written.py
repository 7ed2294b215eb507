"""What was written: old values and what they were worth stay known, whatever comes after."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.view.accelerometers import imu_view
from onboard.daemon.view.journal_lines import journal_view
from onboard.daemon.view.written import LATEST_SHOWN, written_view
from onboard.mavlink.parameter_messages import to_float32
from onboard.push.entries import Closed, Planned, Purpose, Result, Verdict, Watched
from onboard.push.journal import Journal
from onboard.push.plan import propose
from tests.daemon.daemons import calibration


def parameters(imu=1, scale=(1.0, 1.0, 1.0), offset=(0.05, 0.06, 0.07)):
    six = dict(zip(parameter_names(imu).six, (*scale, *offset), strict=True))
    return {**six, parameter_names(imu).device_id: 4.0}


def plan(imu=1, **changes):
    answer = calibration(imu, velocity_rms_before=2.3, velocity_rms_after=0.05, **changes)
    return propose(answer, parameters(imu), system_id=1)


def pushed(name, pushing=None, result=Result.COMPLETED, purpose=Purpose.PUSH):
    pushing = pushing or plan()
    return [
        Planned(name, pushing, purpose),
        Closed(name, result, "none", "said so", pushing.wanted),
    ]


def seen(*entries):
    return written_view([(1000.0 + i, entry) for i, entry in enumerate(entries)])


def test_the_old_values_their_residual_and_the_next_flight_are_there_after_a_restart(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        for i, entry in enumerate(pushed("a")):
            journal.append(entry, 1000.0 + i)
        verdict = Watched(
            "a", Verdict.KEPT, "the residual has not grown", held_out=0.9, velocity_rms=0.06
        )
        journal.append(verdict, 2000.0)
    with Journal(path) as journal:
        (view,) = written_view(journal.entries)
    assert (view.imu, view.at, view.in_force) == (1, 1001.0, True)
    assert (view.velocity_rms_before_m_s, view.velocity_rms_after_m_s) == (2.3, 0.05)
    assert (view.held_out_before, view.held_out_after) == (4.0, 1.0)
    assert (view.verdict, view.next_velocity_rms_m_s, view.next_held_out) == ("kept", 0.06, 0.9)
    x = view.values[0]
    assert (x.name, x.before, x.written) == ("INS_ACCSCAL_X", 1.0, to_float32(1.02))
    assert x.read_back == x.written


def test_a_later_small_push_does_not_hide_what_the_first_was_good_for():
    small = plan(held_out_before=1.1)
    views = seen(*pushed("a"), *(e for i in range(9) for e in pushed(f"b{i}", small)))
    assert len(views) == 1 + LATEST_SHOWN
    assert views[0].held_out_before == 4.0
    assert [view.in_force for view in views] == [False] * LATEST_SHOWN + [True]


@pytest.mark.parametrize(
    ("after", "shown"),
    [
        (pushed("b", plan().reversed(), purpose=Purpose.ROLL_BACK), [False]),
        (pushed("b", result=Result.ROLLED_BACK), [True]),
        ([Closed("a", Result.ROLLED_BACK, "restarted", "gone after a reboot", {})], []),
        (pushed("b", plan(2)), [True, True]),
    ],
)
def test_what_is_in_force_is_what_a_roll_back_would_take_back(tmp_path, after, shown):
    entries = [*pushed("a"), *after]
    assert [view.in_force for view in seen(*entries)] == shown
    with Journal(tmp_path / "journal.jsonl") as journal:
        for entry in entries:
            journal.append(entry, 1.0)
        for view in seen(*entries):
            assert view.in_force == (journal.last_completed(view.imu) is not None)


def test_what_was_written_to_another_board_is_not_shown():
    entries = list(
        enumerate(pushed("a", propose(calibration(), parameters(), system_id=1, board="aa")))
    )
    assert len(written_view(entries, 1, "aa")) == 1
    assert len(written_view(entries, 1)) == 1  # it does not tell which it is
    assert written_view(entries, 1, "bb") == ()
    assert written_view(entries, 2) == ()


def test_the_first_push_survives_the_journals_cleaning(tmp_path):
    with Journal(tmp_path / "journal.jsonl", limit_bytes=20_000, keep=3) as journal:
        for i in range(30):
            for entry in pushed(f"t{i}", plan(held_out_before=9.0) if i == 0 else None):
                journal.append(entry, float(i))
        kept = {e.transaction for _, e in journal.entries if isinstance(e, Planned)}
        assert len(kept) < 30
        assert written_view(journal.entries)[0].held_out_before == 9.0


def test_an_accelerometer_shows_what_is_in_force_now_while_another_is_written():
    """The learner's answer may be minutes old; the autopilot has said what it has."""
    answer = calibration(velocity_rms_before=2.3, velocity_rms_after=0.05)
    before = imu_view(answer, parameters=parameters())
    assert before.in_force_scale == (1.0, 1.0, 1.0)
    assert (before.velocity_rms_before_m_s, before.velocity_rms_after_m_s) == (2.3, 0.05)
    after = imu_view(answer, parameters=parameters(scale=answer.scale, offset=answer.offset))
    assert after.in_force_scale == answer.scale
    assert after.in_force_offset == answer.offset
    assert after.velocity_rms_before_m_s is None
    assert after.held_out_before is None
    assert after.velocity_rms_after_m_s == 0.05


def test_a_parameter_as_float32_is_no_other_value():
    answer = replace(calibration(), in_force_scale=(1.02, 0.99, 1.01), velocity_rms_before=2.3)
    read = parameters(scale=tuple(to_float32(v) for v in answer.in_force_scale))
    assert imu_view(answer, parameters=read).velocity_rms_before_m_s == 2.3


def test_parameters_that_were_never_read_are_those_that_are_assumed():
    assumed = replace(calibration(), parameters_known=False)
    shown = imu_view(assumed, parameters=parameters(scale=(1.1, 1.1, 1.1)))
    assert shown.in_force_scale == (1.0, 1.0, 1.0)
    assert math.isclose(shown.held_out_before or 0.0, 4.0)


def test_what_a_run_before_has_written_is_told_from_this_ones_whatever_the_clock_says(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        for entry in pushed("a"):
            journal.append(entry, 5000.0)
        assert not any(line.earlier for line in journal_view(journal.entries, journal.appended))
    with Journal(path) as journal:  # after a boot without a clock
        journal.append(Watched("a", Verdict.KEPT, "as it was"), 70.0)
        lines = journal_view(journal.entries, journal.appended)
        assert [line.earlier for line in lines] == [True, True, False]
        assert [line.earlier for line in journal_view(journal.entries[-1:], 1)] == [False]
