"""Results on disk: what is whole is used, what is not is told of and made anew."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from onboard.batches.store import Store
from onboard.errors import UsageError
from tests.fleet.records_by_hand import flown

KEY = "ab" + 62 * "0" + "-0123456789abcdef"


@pytest.fixture
def kept(tmp_path):
    """A store with one record and its page, and the record's file."""
    store, notes = Store(tmp_path / "store"), []
    store.keep(KEY, flown("a.BIN", seed=1).record, b"page", notes)
    assert notes == []
    (file,) = store.folder.rglob("*.record")
    return store, file


def test_what_was_kept_comes_back(kept):
    store, _ = kept
    notes = []
    encode = msgspec.msgpack.encode
    assert encode(store.record(KEY, notes)) == encode(flown("a.BIN", seed=1).record)
    assert store.page(KEY, notes) == b"page"
    assert store.record(KEY.replace("ab", "cd"), notes) is None
    assert notes == []


@pytest.mark.parametrize("cut", [0, 10, 80, 200, -1])
def test_a_torn_file_is_ignored_with_a_reason(kept, cut):
    store, file = kept
    file.write_bytes(file.read_bytes()[:cut])
    notes = []
    assert store.record(KEY, notes) is None
    (note,) = notes
    assert str(file) in note
    assert "replayed anew" in note


def test_a_changed_byte_is_noticed(kept):
    store, file = kept
    data = bytearray(file.read_bytes())
    for place in (3, 30, len(data) // 2, len(data) - 1):
        damaged = bytearray(data)
        damaged[place] ^= 1
        file.write_bytes(damaged)
        notes = []
        assert store.record(KEY, notes) is None
        assert len(notes) == 1


def test_whole_bytes_of_something_else_are_no_record(kept):
    store, file = kept
    store._write(file, b"\x93\x01\x02\x03")
    notes = []
    assert store.record(KEY, notes) is None
    assert "replayed anew" in notes[0]


def test_nothing_half_written_is_left(kept, monkeypatch):
    store, file = kept
    before = file.read_bytes()

    def full(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    notes = []
    store.keep(KEY, flown("b.BIN").record, None, notes)
    assert "No space left on device" in notes[0]
    assert file.read_bytes() == before
    assert not list(store.folder.rglob("*.part"))


def test_a_store_that_cannot_be_written_is_told_of_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be written"):
        Store(tmp_path / "file").prepare()
