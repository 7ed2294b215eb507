"""State of any bytes is used, or set aside with a named error; no start fails for ever."""

from __future__ import annotations

from zlib import crc32

import msgspec
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.daemon.learning.flight import decode
from onboard.daemon.learning.store import LARGEST, Store
from onboard.daemon.view.history import History
from onboard.errors import StateError
from onboard.push import journal as journal_module
from onboard.push import journal_file
from onboard.push.journal import Journal
from tests.daemon.blank_snapshot import blank_snapshot

DEEP = 100_000


def line(entry: bytes) -> bytes:
    return b'{"schema":1,"at":1.0,"check":%d,"entry":%s}\n' % (crc32(entry), entry)


def found(extra: bytes = b"") -> bytes:
    head = b'{"type":"found","transaction":"a","imu":1,"verdict":"","effects":[],"missing":""'
    return head + extra + b"}"


HOSTILE_LINES = {
    "nested deep": line(b"[" * DEEP + b"]" * DEEP),
    "nested deep in a field that is not known": line(found(b',"x":' + b"[" * DEEP + b"]" * DEEP)),
    "nested deep instead of a line": b"[" * DEEP + b"\n",
    "a number of 5000 digits": line(found().replace(b'"imu":1', b'"imu":' + b"9" * 5000)),
    "not UTF-8": line(found().replace(b'"a"', b'"\xff"')),
    "no line at all": b"\xff" * 1000 + b"\n",
    "longer than a line can be": b" " * (journal_module.LONGEST_LINE + 1) + b"\n",
}


@pytest.mark.parametrize("name", HOSTILE_LINES)
def test_a_hostile_line_of_the_journal_is_counted_and_the_rest_is_read(tmp_path, name):
    path = tmp_path / "journal.jsonl"
    path.write_bytes(line(found()) + HOSTILE_LINES[name] + line(found()))
    with Journal(path, limit_bytes=10**9) as journal:
        assert (len(journal.entries), journal.damaged) == (2, 1)


def test_a_journal_without_end_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(journal_file, "LARGEST", 1000)
    path = tmp_path / "journal.jsonl"
    path.write_bytes(line(found()) * 100)
    for _ in range(2):  # the first leaves no lock behind
        with pytest.raises(StateError, match="larger than"):
            Journal(path)


def test_one_byte_of_the_saved_sums_that_is_no_text(tmp_path):
    store = Store(tmp_path)
    store.save(1, b"sums", version="1.0", saved_at=1.0)
    whole = store.path(1).read_bytes()
    for at in range(len(whole)):
        store.path(1).write_bytes(whole[:at] + b"\xff" + whole[at + 1 :])
        try:
            store.load(1)
        except StateError:
            assert store.load(1) is None  # set aside: the next start is clean


@pytest.mark.parametrize("body", [b"\x91" * DEEP, b"\x81\xa1\xff" * DEEP, b"\xdd\xff\xff\xff\xff"])
def test_nested_or_endless_state_is_an_error_with_a_name(tmp_path, body):
    store = Store(tmp_path)
    store.path(1).write_bytes(body)
    with pytest.raises(StateError):
        store.load(1)
    store.path(1).write_bytes(
        msgspec.msgpack.encode({"schema": 2, "x": 0})[:-1] + body  # where a field is skipped
    )
    with pytest.raises(StateError):
        store.load(1)
    assert decode(body) is None
    with pytest.raises(StateError):
        Calibrator().lay_aside(body)
    (tmp_path / "history-1.bin").write_bytes(body)
    history = History(tmp_path, clock=lambda: 0.0)
    history.take(blank_snapshot())


def test_sums_larger_than_any_are_not_read(tmp_path):
    store = Store(tmp_path)
    with store.path(1).open("wb") as file:
        file.truncate(LARGEST + 1)
    with pytest.raises(StateError, match="larger than"):
        store.load(1)
    assert store.load(1) is None
