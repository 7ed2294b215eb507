import errno
import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.errors import StateError
from onboard.push.entries import Found, Purpose, ReadBack, Result, Undoing, Verdict, Watched
from onboard.push.journal import Journal
from tests.push.journals import PLAN, closed, read, story, write


def test_what_was_written_is_read_back(path):
    entries = [*story("a"), Undoing("b", "armed", "x"), Watched("a", Verdict.KEPT, "fine")]
    write(path, entries[:-2] + entries[-1:])
    assert read(path) == (entries[:-2] + entries[-1:], (), 0)


def test_one_line_of_json_per_entry(path):
    write(path, story("a"))
    lines = path.read_bytes().splitlines()
    assert len(lines) == 5
    assert all(line.startswith(b"{") and line.endswith(b"}") for line in lines)


def test_entry_is_on_the_disk_before_append_returns(path, monkeypatch):
    synced = []
    real = os.fsync

    def fsync(descriptor):
        synced.append(path.read_bytes())
        real(descriptor)

    with Journal(path) as journal:
        monkeypatch.setattr(os, "fsync", fsync)
        journal.append(story("a")[0], 1.0)
        assert synced[-1].endswith(b"\n")
        assert b"planned" in synced[-1]


def test_open_transaction_says_what_is_confirmed(path):
    write(path, story("a") + story("b")[:-1])
    _, (recovery,), _ = read(path)
    assert recovery.transaction == "b"
    assert recovery.plan == PLAN
    assert recovery.confirmed == {PLAN.names[0]}
    assert not recovery.undo
    assert not recovery.all_confirmed


def test_begun_roll_back_is_remembered(path):
    write(path, [*story("a")[:-1], Undoing("a", "armed", "x")])
    _, (recovery,), _ = read(path)
    assert recovery.undo


def test_confirmation_counts_only_when_stored_and_of_the_wanted_value(path):
    name = PLAN.names[0]
    entries = [
        story("a")[0],
        ReadBack("a", name, PLAN.before[name], saved=True),
        ReadBack("a", name, PLAN.wanted[name], saved=False),
    ]
    write(path, entries)
    _, (recovery,), _ = read(path)
    assert recovery.confirmed == frozenset()


@settings(max_examples=60, deadline=None)
@given(cut=st.integers(0, 4000))
def test_torn_anywhere_only_the_torn_line_is_lost(tmp_path_factory, cut):
    path = tmp_path_factory.mktemp("torn") / "j"
    entries = story("a") + story("b")[:-1]
    write(path, entries)
    data = path.read_bytes()[:cut]
    path.write_bytes(data)
    whole = data.count(b"\n")
    with Journal(path) as journal:
        assert [e for _, e in journal.entries] == entries[:whole]
        assert journal.damaged == 0
        journal.append(closed("a", Result.ABORTED), 5.0)
    found, _, damaged = read(path)
    assert found == [*entries[:whole], closed("a", Result.ABORTED)]
    assert damaged == 0


def test_damaged_line_in_the_middle_is_skipped_and_counted(path):
    write(path, story("a") + story("b"))
    lines = path.read_bytes().splitlines(keepends=True)
    lines[2] = lines[2].replace(b"INS", b"JNS")
    lines[3] = b"\x00" * 40 + b"\n"
    path.write_bytes(b"".join(lines))
    found, open_ones, damaged = read(path)
    assert len(found) == 8
    assert damaged == 2
    assert open_ones == ()


def test_lost_close_leaves_it_open_and_lost_plan_is_an_error(path):
    write(path, story("a"))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-1]))
    assert len(read(path)[1]) == 1
    path.write_bytes(b"".join(lines[1:-1]))
    with Journal(path) as journal, pytest.raises(StateError, match="plan is damaged"):
        journal.recover()


def test_newer_version_is_not_touched(path):
    write(path, story("a"))
    data = path.read_bytes().replace(b'"schema":1', b'"schema":2')
    path.write_bytes(data)
    with pytest.raises(StateError, match="newer"):
        Journal(path)
    assert path.read_bytes() == data


def test_second_process_is_refused(path):
    with Journal(path), pytest.raises(StateError, match="in use"):
        Journal(path)
    Journal(path).close()


def test_unusable_place_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StateError):
        Journal(tmp_path / "file" / "journal")
    with pytest.raises(StateError):
        Journal(tmp_path)


class TestSize:
    def test_stays_bounded_and_keeps_what_is_needed(self, path):
        with Journal(path, limit_bytes=20_000, keep=3) as journal:
            for entry in story("first-of-imu-2", imu=2):
                journal.append(entry, 1.0)
            for entry in story("open", imu=3)[:-1]:
                journal.append(entry, 1.0)
            for entry in story("in vain", result=Result.ROLLED_BACK):
                journal.append(entry, 1.0)
            for i in range(200):
                for entry in story(f"t{i}"):
                    journal.append(entry, float(i))
                # one story is below 4 kB, and what must be kept below 16 kB
                assert path.stat().st_size < 40_000
        with Journal(path) as journal:
            assert [r.transaction for r in journal.recover()] == ["open"]
            assert journal.last_completed(2).transaction == "first-of-imu-2"
            assert journal.last_completed(1).transaction == "t199"
            # What calibrating was good for is told by the first that succeeded.
            assert {"t0", "t199"} <= {e.transaction for _, e in journal.entries}
            assert "in vain" not in {e.transaction for _, e in journal.entries}
        assert [p.name for p in path.parent.iterdir()] == [path.name]

    def test_shrinking_does_not_put_a_push_in_force_that_was_taken_back(self, path):
        with Journal(path, limit_bytes=20_000, keep=3) as journal:
            for entry in story("push") + story("back", purpose=Purpose.ROLL_BACK):
                journal.append(entry, 1.0)
            for i in range(400):
                journal.append(Found(f"f{i}", 1, "clean", (), ""), float(i))
            assert path.stat().st_size < 40_000
        with Journal(path) as journal:
            assert journal.last_completed(1) is None
            assert journal.last_written(1).transaction == "back"

    def test_shrinking_keeps_no_descriptor(self, path):
        with Journal(path, limit_bytes=4_000, keep=1) as journal:
            there = len(os.listdir("/proc/self/fd"))
            files = set()
            for i in range(20):
                for entry in story(f"t{i}"):
                    journal.append(entry, float(i))
                files.add(path.stat().st_ino)
            assert len(files) > 1, "rewritten"
            assert len(os.listdir("/proc/self/fd")) == there

    @pytest.mark.parametrize("call", ["fsync", "rename", "write"])
    def test_failing_to_shrink_loses_nothing(self, path, monkeypatch, call):
        write(path, story("a") + story("b") + story("c"))

        def fail(*args, **kwargs):
            raise OSError(errno.EIO, "Input/output error")

        expected = read(path)
        there = len(os.listdir("/proc/self/fd"))
        with monkeypatch.context() as patch:
            if call == "rename":
                patch.setattr("pathlib.Path.rename", fail)
            elif call == "write":
                patch.setattr(os, "write", fail)
            else:
                calls = iter([os.fsync])  # the directory's first sync, at opening, has to work

                def fsync(descriptor):
                    next(calls, fail)(descriptor)

                patch.setattr(os, "fsync", fsync)
            journal = Journal(path, limit_bytes=10, keep=1)
        assert len(os.listdir("/proc/self/fd")) == there + 1
        journal.append(story("d")[0], 9.0)
        journal.close()
        found, _, _ = read(path)
        assert found == [*expected[0], story("d")[0]]

    def test_lock_survives_shrinking(self, path):
        write(path, story("a") + story("b"))
        with Journal(path, limit_bytes=10, keep=1), pytest.raises(StateError, match="in use"):
            Journal(path)


class TestWhatIsInForce:
    def test_nothing_yet(self, path):
        with Journal(path) as journal:
            assert journal.last_completed(1) is None

    def test_the_last_completed_push(self, path):
        write(path, story("a") + story("b") + story("c", result=Result.ROLLED_BACK))
        with Journal(path) as journal:
            assert journal.last_completed(1).transaction == "b"
            assert journal.last_completed(2) is None

    def test_not_after_its_roll_back(self, path):
        write(path, story("a") + story("back", purpose=Purpose.ROLL_BACK))
        with Journal(path) as journal:
            assert journal.last_completed(1) is None

    def test_a_way_back_that_did_not_last_leaves_the_push_in_force(self, path):
        back = story("back", purpose=Purpose.ROLL_BACK)
        write(path, story("a") + back + [closed("back", Result.ROLLED_BACK)])
        with Journal(path) as journal:
            assert journal.last_completed(1).transaction == "a"
            assert journal.last_written(1).transaction == "a"

    def test_roll_back_that_failed_leaves_the_push_in_force(self, path):
        back = story("back", purpose=Purpose.ROLL_BACK, result=Result.ROLLED_BACK)
        write(path, story("a") + back)
        with Journal(path) as journal:
            assert journal.last_completed(1).transaction == "a"
