"""The sums on disk: whole or not at all."""

import os

import msgspec
import pytest

from onboard.daemon.learning import limits
from onboard.daemon.learning.store import Store
from onboard.errors import StateError

SUMS = bytes(range(256)) * 20


def saved(directory, sums=SUMS, system=1):
    store = Store(directory)
    store.save(system, sums, version="1", saved_at=100.0)
    return store


def test_what_is_saved_comes_back(tmp_path):
    loaded = saved(tmp_path / "new" / "directory").load(1)
    assert (loaded.sums, loaded.saved_at, loaded.system_id) == (SUMS, 100.0, 1)


def test_vehicles_do_not_mix(tmp_path):
    store = saved(tmp_path)
    saved(tmp_path, b"other", system=2)
    assert store.load(1).sums == SUMS
    assert store.load(3) is None


def test_boards_of_one_vehicle_do_not_mix(tmp_path):
    store = saved(tmp_path)
    store.save(1, b"of a board", version="1", saved_at=1.0, board="0a0b")
    assert store.load(1).sums == SUMS
    assert store.load(1, "0a0b").sums == b"of a board"
    assert store.load(1, "0c0d") is None
    with pytest.raises(ValueError, match="no board's id"):
        store.path(1, "../etc")


def test_what_an_older_version_has_saved_is_set_aside(tmp_path):
    store = saved(tmp_path)
    old = msgspec.msgpack.decode(store.path(1).read_bytes()) | {"schema": 1}
    store.path(1).write_bytes(msgspec.msgpack.encode(old))
    with pytest.raises(StateError, match="of version 1"):
        store.load(1)


@pytest.mark.parametrize("keep", [0, 1, 100, 5000])
def test_a_torn_file_is_set_aside_and_told_once(tmp_path, keep):
    store = saved(tmp_path)
    data = store.path(1).read_bytes()
    assert keep < len(data)
    store.path(1).write_bytes(data[:keep])
    with pytest.raises(StateError, match=r"sums-1\.bin.*sums-1\.refused"):
        store.load(1)
    assert store.load(1) is None


def test_a_flipped_bit_in_the_sums_is_found(tmp_path):
    store = saved(tmp_path)
    data = bytearray(store.path(1).read_bytes())
    data[data.index(SUMS[:50]) + 25] ^= 1
    store.path(1).write_bytes(bytes(data))
    with pytest.raises(StateError, match="damaged"):
        store.load(1)


def test_a_save_that_cannot_be_made_leaves_the_old_file(tmp_path, monkeypatch):
    store = saved(tmp_path)
    monkeypatch.setattr("os.fsync", lambda _fd: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(StateError, match="No space"):
        store.save(1, b"new", version="1", saved_at=0.0)
    monkeypatch.undo()
    assert store.load(1).sums == SUMS


def test_a_directory_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StateError, match="file"):
        Store(tmp_path / "file" / "below")


def test_boards_that_are_made_up_take_a_bounded_place_and_drive_out_none_that_has_flown(tmp_path):
    store = Store(tmp_path)
    flown, empty = bytes(3 * limits.NOTHING_LEARNED), b"nothing"
    options = {"version": "1", "saved_at": 0.0}
    for number in range(3):
        store.save(1, flown, board=f"aa{number:02x}", **options)
    for number in range(3 * limits.BOARDS_KEPT):
        store.save(1, empty, board=f"bb{number:04x}", **options)
        assert len(list(tmp_path.glob("sums-*"))) <= limits.BOARDS_KEPT
    assert all(store.load(1, f"aa{number:02x}").sums == flown for number in range(3))
    # And the board that is there now is always saved.
    assert store.load(1, f"bb{3 * limits.BOARDS_KEPT - 1:04x}").sums == empty


def test_of_boards_that_have_flown_the_oldest_gives_way(tmp_path):
    store = Store(tmp_path)
    flown = bytes(3 * limits.NOTHING_LEARNED)
    for number in range(limits.BOARDS_KEPT + 2):
        store.save(1, flown, version="1", saved_at=0.0, board=f"{number:04x}")
        os.utime(store.path(1, f"{number:04x}"), (number, number))
    gone = [n for n in range(limits.BOARDS_KEPT + 2) if store.load(1, f"{n:04x}") is None]
    assert gone == [0, 1]


def as_named_before(directory, system, board, sums, mtime):
    """A file whose name has the system id in it, too."""
    store = Store(directory)
    store.save(system, sums, version="1", saved_at=1.0, board=board)
    older = directory / f"sums-{system}-{board}.bin"
    store.path(system, board).replace(older)
    os.utime(older, (mtime, mtime))


def test_a_board_is_itself_under_any_system_id(tmp_path):
    store = Store(tmp_path)
    store.save(1, SUMS, version="1", saved_at=1.0, board="0a0b")
    assert store.load(7, "0a0b").sums == SUMS
    assert store.load(7) is None


@pytest.mark.parametrize(("system", "expected"), [(1, b"one"), (2, b"two"), (7, b"two")])
def test_files_with_older_names_are_found(tmp_path, system, expected):
    """Its own system's before others', then the newest; and they are forgotten, too."""
    as_named_before(tmp_path, 1, "0a0b", b"one", 100.0)
    as_named_before(tmp_path, 2, "0a0b", b"two", 200.0)
    as_named_before(tmp_path, 3, "ff0a0b", b"of another board", 300.0)
    store = Store(tmp_path)
    assert store.load(system, "0a0b").sums == expected
    store.save(system, b"new", version="1", saved_at=1.0, board="0a0b")
    assert store.load(5, "0a0b").sums == b"new"
    store.forget(system, "0a0b")
    assert store.load(system, "0a0b") is None
    assert store.load(3, "ff0a0b").sums == b"of another board"
