import errno
import os
import shutil
from contextlib import ExitStack

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.errors import StateError
from onboard.push.entries import (
    Closed,
    Found,
    Planned,
    Purpose,
    ReadBack,
    Refused,
    Result,
    Undoing,
    Verdict,
    Watched,
    Writing,
)
from onboard.push.journal import Journal
from tests.daemon.disks import failing
from tests.push.pushing import make_plan

PLAN = make_plan()


def closed(name, result=Result.COMPLETED):
    return Closed(name, result, "none", "said so", PLAN.wanted)


def story(name, imu=1, result=Result.COMPLETED, purpose=Purpose.PUSH):
    plan = make_plan(imu=imu)
    first, second = plan.names[:2]
    return [
        Planned(name, plan, purpose),
        Writing(name, first, plan.before[first], plan.wanted[first]),
        ReadBack(name, first, plan.wanted[first], saved=True),
        Writing(name, second, plan.before[second], plan.wanted[second]),
        closed(name, result),
    ]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "state" / "journal.jsonl"


def write(path, entries, **kwargs):
    with Journal(path, **kwargs) as journal:
        for i, entry in enumerate(entries):
            journal.append(entry, 1000.0 + i)


def read(path):
    with Journal(path) as journal:
        return [e for _, e in journal.entries], journal.recover(), journal.damaged


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


@pytest.mark.parametrize("number", [errno.EIO, errno.EROFS, errno.ENOSPC, errno.EACCES])
@pytest.mark.parametrize(
    "broken", ["onboard.push.journal_file._sync_directory", "pathlib.Path.read_bytes"]
)
def test_a_start_that_fails_leaves_no_lock(path, monkeypatch, broken, number):
    def fail(*_):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as failing:
        failing.setattr(broken, fail)
        if number == errno.EACCES:  # no disk's fault, and nothing that goes away
            with pytest.raises(StateError, match="Permission"):
                Journal(path)
        else:
            with Journal(path) as journal:
                assert os.strerror(number) in journal.trouble
                with pytest.raises(StateError, match=os.strerror(number)):
                    journal.append(story("a")[0], 1.0)
    Journal(path).close()


class TestADiskInTrouble:
    @pytest.fixture
    def disk(self, path, monkeypatch):
        with ExitStack() as stack:
            stack.enter_context(failing(monkeypatch, path.parent))
            yield stack

    def test_what_it_has_is_known_and_what_it_does_not_take_is_not_called_written(
        self, path, monkeypatch
    ):
        write(path, story("a")[:3])
        before = path.read_bytes()
        with failing(monkeypatch, path.parent), Journal(path) as journal:
            assert journal.read
            (recovery,) = journal.recover()
            assert recovery.transaction == "a"
            with pytest.raises(StateError):
                journal.append(story("b")[0], 2.0)
            assert [e for _, e in journal.entries] == story("a")[:3]
            with pytest.raises(StateError, match="in use"):
                Journal(path)
        assert path.read_bytes() == before

    def test_what_only_says_something_is_owed_and_written_first(self, path, disk):
        refused, found = Refused("r", 1, "a person rejected it"), story("b")
        with Journal(path) as journal:
            for entry in (refused, found[0]):
                with pytest.raises(StateError):
                    journal.append(entry, 1.0)
                journal.owe(entry, 1.0)
            assert journal.refusals() == {1: "a person rejected it"}
            assert [e for _, e in journal.entries] == [refused], "a plan is written, or is not"
            disk.close()
            journal.append(found[0], 2.0)
            assert not journal.trouble
            assert list(journal.entries) == [(1.0, refused), (2.0, found[0])]
        assert read(path)[0] == [refused, found[0]]

    def test_it_is_over_when_there_is_room_for_a_transaction(self, path, disk, monkeypatch):
        refused = Refused("r", 1, "a person rejected it")
        with Journal(path) as journal:
            journal.owe(refused, 1.0)
            with pytest.raises(StateError):
                journal.settle()
            disk.close()
            real = os.write

            def nearly_full(descriptor, data):
                if len(data) > 4000:
                    raise OSError(errno.ENOSPC, "No space left on device")
                return real(descriptor, data)

            with monkeypatch.context() as patch:
                patch.setattr(os, "write", nearly_full)
                with pytest.raises(StateError, match="No space"):
                    journal.settle()
            assert journal.trouble
            journal.settle()
            assert not journal.trouble
        assert os.listdir(path.parent) == [path.name]
        assert read(path)[0] == [refused]

    def test_one_that_is_closed_is_not_opened_again(self, path, disk):
        journal = Journal(path)
        journal.close()
        disk.close()
        with pytest.raises(StateError, match="closed"):
            journal.settle()
        Journal(path).close()


def test_full_disk_is_reported_and_the_file_stays_whole(path, monkeypatch):
    entries = story("a")
    with Journal(path) as journal:
        journal.append(entries[0], 1.0)
        real = os.write

        def write_half(descriptor, data):
            if len(data) < 60:
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(descriptor, data[: len(data) // 2])

        with monkeypatch.context() as patch:
            patch.setattr(os, "write", write_half)
            with pytest.raises(StateError, match="No space"):
                journal.append(entries[1], 2.0)
        assert [e for _, e in journal.entries] == entries[:1]
        journal.append(entries[2], 3.0)
    found, (recovery,), damaged = read(path)
    assert (found, recovery.transaction, damaged) == ([entries[0], entries[2]], "a", 0)


def moved_and_linked(directory):
    """As somebody does who wants the state on another disk: moved, and a link in its place."""
    elsewhere = directory.with_name("elsewhere")
    shutil.copytree(directory, elsewhere)
    shutil.rmtree(directory)
    directory.symlink_to(elsewhere)


def older_put_back(directory):
    (directory / "journal.jsonl").replace(directory / "of today")
    (directory / "journal.jsonl").write_bytes(b"")


def deleted(directory):
    shutil.rmtree(directory)


@pytest.mark.parametrize("change", [moved_and_linked, older_put_back, deleted])
def test_what_the_next_start_would_not_read_is_not_called_written(path, change):
    first, second = story("a"), story("b")
    with Journal(path) as journal:
        for entry in first:
            journal.append(entry, 1.0)
        change(path.parent)
        with pytest.raises(StateError, match="not the journal that was opened"):
            journal.append(second[0], 2.0)
        assert [e for _, e in journal.entries] == first
    with Journal(path) as journal:
        assert journal.recover() == ()
        journal.append(second[0], 3.0)
        assert [found.transaction for found in journal.recover()] == ["b"]


def test_a_directory_that_is_reached_by_another_way_is_the_same(path):
    entries = story("a")
    with Journal(path) as journal:
        journal.append(entries[0], 1.0)
        path.parent.rename(path.parent.with_name("moved"))
        path.parent.symlink_to("moved")
        journal.append(entries[1], 2.0)
    assert read(path)[0] == entries[:2]


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
