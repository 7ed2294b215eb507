"""The sums on disk: whole or not at all."""

import msgspec
import pytest

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
