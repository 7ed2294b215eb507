"""Disks that are full, that fail, and that are changed behind the journal's back."""

import errno
import os
import shutil
from contextlib import ExitStack

import pytest

from onboard.errors import StateError
from onboard.push.entries import Refused
from onboard.push.journal import Journal
from tests.daemon.disks import failing
from tests.push.journals import read, story, write


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
