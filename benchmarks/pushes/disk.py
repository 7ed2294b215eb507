"""A disk that is full, torn or gone in the middle of a write; the journal on it is the real one."""

from __future__ import annotations

import contextlib
import errno
import os
import random
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from onboard.push import journal_file


class KilledError(BaseException):
    """The service ends here, at once; nothing of it runs any more."""


class Disk:
    """What happens to writes and to their way to the platter.

    ``dies_at`` is the number of the disk operation in which the service is killed or the power is
    cut, ``full`` whether it takes nothing more.  Bytes that were not synchronised are there after
    that, or not, or in part.
    """

    def __init__(self, rng: random.Random) -> None:
        self.dies_at: int | None = None
        self.full = False
        self.operations = 0
        self._open: set[int] = set()
        self._rng = rng

    def write(self, fd: int, data: bytes) -> None:
        """In place of the journal's own; some bytes arrive, all, or none."""
        part = data[: self._rng.randrange(len(data) + 1)]
        if self._is_last():
            os.write(fd, part)
            raise KilledError
        if self.full:
            os.write(fd, part)
            raise OSError(errno.ENOSPC, "No space left on device")
        os.write(fd, data)

    def fsync(self, fd: int) -> None:
        """What was written before is on the platter when this returns."""
        if self._is_last():
            size = os.fstat(fd).st_size
            os.ftruncate(fd, max(0, size - self._rng.choice((0, 0, 1, 40, 90))))
            raise KilledError
        if self.full and self._rng.random() < 0.5:
            raise OSError(errno.EIO, "Input/output error")

    def sync_directory(self, _path: Path) -> None:
        """A new file's name is on the platter when this returns."""
        if self._is_last():
            raise KilledError

    def open(self, path: Path, flags: int, mode: int = 0o777) -> int:
        """As the system does it; who is killed leaves it to the system to close."""
        fd = os.open(path, flags, mode)
        self._open.add(fd)
        return fd

    def close(self, fd: int) -> None:
        """As the system does it."""
        self._open.discard(fd)
        os.close(fd)

    def release(self) -> None:
        """The process has ended: what it had open is closed, and so no longer locked."""
        for fd in tuple(self._open):
            self.close(fd)

    def _is_last(self) -> bool:
        self.operations += 1
        if self.dies_at is not None and self.operations >= self.dies_at:
            self.dies_at = None
            return True
        return False


class _Os:
    """The module ``os`` with another ``fsync``, and a memory of what is open."""

    def __init__(self, disk: Disk) -> None:
        self.fsync, self.open, self.close = disk.fsync, disk.open, disk.close

    def __getattr__(self, name: str) -> object:
        return getattr(os, name)


@contextlib.contextmanager
def journals_on(disk: Disk) -> Iterator[None]:
    """While this lasts every journal writes to this disk."""
    with patch.multiple(
        journal_file, os=_Os(disk), _write_all=disk.write, _sync_directory=disk.sync_directory
    ):
        yield
