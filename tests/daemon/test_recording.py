"""Recordings of bounded size: rolled over whole frames, the oldest deleted."""

import asyncio
import os
import shutil

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.daemon.setup.recording import LEFT_FREE, RollingRecorder
from onboard.errors import StateError
from tests.daemon.daemons import until

FRAME = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3).pack(mavlink.MAVLink(None))


async def record(directory, *, frames, file_bytes, keep, per_flush, monkeypatch):
    monkeypatch.setattr("onboard.mavlink.limits.FLUSH_INTERVAL_S", 0.001)
    seconds = iter(range(1, 1_000_000))
    recorder = RollingRecorder(
        directory, keep=keep, file_bytes=file_bytes, wall_clock=lambda: float(next(seconds))
    )
    task = asyncio.create_task(recorder.run())
    for _ in range(frames // per_flush):
        for _ in range(per_flush):
            recorder.write(1000.0, FRAME)
        await until(lambda: not recorder._pending)
        await asyncio.sleep(0.005)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    return sorted(directory.glob("*.tlog"))


async def test_files_roll_over_between_frames_and_nothing_is_lost(tmp_path, monkeypatch):
    line = 8 + len(FRAME)
    files = await record(
        tmp_path, frames=60, file_bytes=10 * line, keep=100, per_flush=5, monkeypatch=monkeypatch
    )
    sizes = [file.stat().st_size for file in files]
    assert sum(sizes) == 60 * line
    assert all(size % line == 0 for size in sizes)
    assert len([size for size in sizes if size]) >= 5


async def test_only_the_newest_are_kept(tmp_path, monkeypatch):
    old = tmp_path / "19990101-000000-000.tlog"
    old.write_bytes(b"x")
    os.utime(old, (0, 0))
    other = tmp_path / "notes.txt"
    other.write_bytes(b"x")
    files = await record(
        tmp_path, frames=40, file_bytes=100, keep=3, per_flush=4, monkeypatch=monkeypatch
    )
    assert 1 <= len(files) <= 3
    assert old not in files
    assert other.exists()


async def test_a_clock_that_is_set_back_by_a_day_costs_none_of_the_newest(tmp_path, monkeypatch):
    """Of a computer without a clock of its own: what was recorded before is of tomorrow."""
    for number in range(5):
        tomorrow = tmp_path / f"19700102-000000-{number:03d}.tlog"
        tomorrow.write_bytes(b"x")
        os.utime(tomorrow, (86_400.0 + number, 86_400.0 + number))
    others = tmp_path / "somebody's own.tlog"
    others.write_bytes(b"x")
    os.utime(others, (0, 0))
    line = 8 + len(FRAME)
    files = await record(
        tmp_path, frames=40, file_bytes=10 * line, keep=4, per_flush=5, monkeypatch=monkeypatch
    )
    assert others in files
    ours = [file for file in files if file != others]
    assert len(ours) == 4
    # All that was recorded but for what four files do not hold, in the order of their names.
    assert sum(file.stat().st_size for file in ours) >= 3 * 10 * line
    assert all(file.read_bytes() != b"x" for file in ours)


async def test_a_directory_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StateError):
        RollingRecorder(tmp_path / "file" / "x", keep=1, file_bytes=1)


class Disk:
    """One that others have filled but for ``free`` bytes and what was recorded before."""

    def __init__(self, directory, free):
        self.directory, self.size = directory, free + self._taken(directory)

    def usage(self, directory):
        assert directory == self.directory
        return shutil._ntuple_diskusage(self.size, 0, self.size - self._taken(directory))

    @staticmethod
    def _taken(directory):
        return sum(path.stat().st_size for path in directory.glob("*"))


async def test_the_oldest_make_room_and_the_journals_is_never_taken(tmp_path, monkeypatch):
    old = [tmp_path / f"1999010{day}-000000-000.tlog" for day in (1, 2, 3)]
    for path in old:
        path.write_bytes(bytes(1000))
    (tmp_path / "of somebody else").write_bytes(bytes(1000))
    disk = Disk(tmp_path, LEFT_FREE + 500)
    monkeypatch.setattr("shutil.disk_usage", disk.usage)
    recorder = RollingRecorder(tmp_path, keep=100, file_bytes=10**6, wall_clock=lambda: 1e9)
    told = []
    recorder.tell = told.append
    task = asyncio.create_task(recorder.run())

    async def write(size):
        for _ in range(size // (8 + len(FRAME))):
            recorder.write(1000.0, FRAME)
        await until(lambda: not recorder._pending)
        await recorder._finish()
        assert disk.usage(tmp_path).free >= LEFT_FREE

    monkeypatch.setattr("onboard.mavlink.limits.FLUSH_INTERVAL_S", 0.001)
    await write(400)
    assert all(path.exists() for path in old)
    await write(900)
    assert [path.exists() for path in old] == [False, True, True]
    await write(1900)
    assert not any(path.exists() for path in old)
    assert told == []
    size = recorder.path.stat().st_size
    await write(900)
    assert recorder.path.stat().st_size == size, "none is left, and it ends"
    assert len(told) == 1
    assert "recording stopped" in told[0]
    assert (tmp_path / "of somebody else").exists()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
