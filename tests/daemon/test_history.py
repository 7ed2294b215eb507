"""The memory behind the charts: bounded, whole in time, gone with what was learned."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.daemon.view.accelerometers import imu_view
from onboard.daemon.view.history import BOARDS_KEPT, ROWS_MAX, SAVE_S, History, Ring, Row
from tests.daemon.blank_snapshot import blank_snapshot
from tests.daemon.daemons import calibration

SIX = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)


def row(trusted: float, value: float = 1.0) -> Row:
    return Row(1.0e9 + trusted, trusted, (value, *SIX[1:]), SIX, SIX)


@given(st.lists(st.floats(0.1, 50.0), min_size=1, max_size=600), st.integers(4, 40))
def test_a_ring_keeps_first_and_newest_in_order_within_its_budget(steps, limit):
    ring, now = Ring(), 0.0
    first = steps[0]
    for step in steps:
        now += step
        assert ring.add(row(now), limit)
        assert len(ring.rows) <= limit
        assert ring.rows[-1].flown_s == now
    times = [r.flown_s for r in ring.rows]
    assert times == sorted(times)
    assert times[0] == first


def test_standing_still_adds_nothing_but_shows_what_changed():
    ring = Ring()
    assert ring.add(row(10.0))
    for _ in range(1000):
        assert not ring.add(row(10.0))
    assert ring.add(row(10.0, 1.02))
    assert [r.value[0] for r in ring.rows] == [1.02]


def seen(trusted: float, system_id: int = 1, *, armed: bool = True, resets: int = 0, scale=1.0):
    blank = blank_snapshot()
    link = msgspec.structs.replace(blank.link, system_id=system_id, armed=armed, landed=not armed)
    answer = calibration(scale=(scale, 1.0, 1.0))
    view = msgspec.structs.replace(imu_view(answer), trusted_s=trusted)
    return msgspec.structs.replace(
        blank, link=link, imus=(view,), time=trusted, counters={"resets": resets}
    )


@pytest.fixture
def clock():
    class Clock:
        now = 0.0

        def __call__(self) -> float:
            return self.now

    return Clock()


def flown(folder: Path, clock, seconds: range, system_id: int = 1) -> History:
    history = History(folder, clock=clock)
    for t in seconds:
        history.take(seen(float(t), system_id))
    return history


def times(history: History) -> list[float]:
    return [r.flown_s for imu in history.document().imus for r in imu.rows]


def test_it_goes_on_after_a_restart(tmp_path, clock):
    before = flown(tmp_path, clock, range(1, 20))
    before.save()
    assert times(flown(tmp_path, clock, range(20, 25))) == [float(t) for t in range(1, 25)]
    assert times(flown(tmp_path, clock, range(5, 6), system_id=2)) == [5.0]


def test_curves_are_of_a_board_whatever_its_system_id(tmp_path, clock):
    there: list[str | None] = [None]

    def flying(seconds, system_id=1):
        history = History(tmp_path, clock=clock, board=lambda: there[0])
        for t in seconds:
            history.take(seen(float(t), system_id))
        history.save()
        return times(history)

    assert flying(range(1, 5)) == [], "it has not said who it is"
    for there[0] in ("0a", "0b"):  # one after the other at the same companion, both as system 1
        assert flying(range(1, 5)) == [1.0, 2.0, 3.0, 4.0]
    there[0] = "0a"
    assert flying(range(5, 7), system_id=7) == [float(t) for t in range(1, 7)]
    there[0] = ""
    assert flying(range(1, 2)) == [1.0]


def test_boards_that_are_made_up_take_a_bounded_place(tmp_path, clock):
    for number in range(BOARDS_KEPT + 9):
        history = History(tmp_path, clock=clock, board=lambda number=number: f"{number:04x}")
        history.take(seen(1.0))
        history.save()
        os.utime(history._path, (number, number))
    kept = sorted(path.name for path in tmp_path.glob("history-*"))
    assert len(kept) == BOARDS_KEPT
    assert f"history-board-{BOARDS_KEPT + 8:04x}.bin" in kept


@pytest.mark.slow
def test_hours_on_the_ground_do_not_push_the_flight_out(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 200))
    flight = times(history)
    for t in range(200, 8000):
        history.take(seen(float(t), armed=False, scale=1.0 + 1e-5 * (t % 7)))
    assert times(history) == flight
    for t in range(8000, 8010):
        history.take(seen(float(t)))
    assert times(history) == [*flight, *(float(t) for t in range(200, 210))]


def test_what_is_refined_after_the_landing_is_the_end_of_the_curve(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 20))
    history.take(seen(25.0, armed=False, scale=1.03))
    (imu,) = history.document().imus
    assert (imu.rows[-1].flown_s, imu.rows[-1].value[0]) == (19.0, 1.03)


def test_before_the_first_flight_there_is_no_curve(tmp_path, clock):
    history = History(tmp_path, clock=clock)
    for t in range(1, 60):
        history.take(seen(float(t), armed=False))
    assert times(history) == []
    history.take(seen(60.0))
    assert times(history) == [1.0]


@pytest.mark.parametrize("saved_at", [0.0, 3.0, 50.0])
def test_sums_of_another_moment_than_the_curve_do_not_end_it(tmp_path, clock, saved_at):
    """Power is cut: sums and curves come back as they were saved, each at its own time."""
    flown(tmp_path, clock, range(1, 20)).save()
    after = History(tmp_path, clock=clock)
    for t in range(3):
        after.take(seen(saved_at + t, armed=False))
    assert times(after) == [float(t) for t in range(1, 20)]
    after.take(seen(saved_at + 3.0))
    assert times(after) == [float(t) for t in range(1, 21)]


def test_the_power_may_go_right_after_the_landing(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 20))
    history.take(seen(19.0, armed=False))
    assert times(flown(tmp_path, clock, range(20, 21))) == [float(t) for t in range(1, 21)]


def test_estimates_that_begin_anew_end_the_curve_when_something_is_flown(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 20))
    history.take(seen(0.0))
    history.take(seen(0.0, armed=False))
    assert times(history) == [float(t) for t in range(1, 20)]
    history.take(seen(2.0))
    assert times(history) == [2.0]


def test_what_a_person_has_forgotten_leaves_no_curve(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 20))
    history.take(seen(19.0, armed=False, resets=1))
    assert times(history) == []


def test_it_is_on_the_disk_now_and_then_and_only_if_there_is_something_new(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 3))
    file = tmp_path / "history-1.bin"
    assert not file.exists()
    clock.now = SAVE_S
    history.take(seen(3.0))
    assert file.exists()
    file.unlink()
    clock.now = 3.0 * SAVE_S
    history.take(seen(3.0))
    assert not file.exists()


@pytest.mark.parametrize("content", [b"", b"junk", msgspec.msgpack.encode({"schema": "other"})])
def test_a_damaged_file_is_begun_anew(tmp_path, clock, content):
    (tmp_path / "history-1.bin").write_bytes(content)
    assert times(flown(tmp_path, clock, range(7, 9))) == [7.0, 8.0]


def test_a_disk_that_takes_nothing_stops_nothing(tmp_path, clock):
    history = flown(tmp_path / "absent", clock, range(1, 3))
    history.save()
    assert times(history) == [1.0, 2.0]


@pytest.mark.slow
def test_the_document_of_five_accelerometers_is_small(tmp_path, clock):
    history = flown(tmp_path, clock, range(1, 2 * ROWS_MAX))
    assert 5 * len(msgspec.json.encode(history.document())) < 300_000
