"""The journal's file: opened, locked, appended to, put in another's place; it knows no entries.

A line is on the disk when :meth:`JournalFile.append` returns, or the file is as it was: what was
left of half a line is cut off before the next one is written.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from pathlib import Path

from onboard.errors import HeldError, StateError, disk_error

LARGEST = 64_000_000
"""bytes; compaction keeps the file near a megabyte [bound]."""
ROOM = 16_384
"""bytes; a transaction of six values that is undone takes some 8000 [bound]."""


class JournalFile:
    """One file of one process; methods block for the time of an fsync.

    Every method raises :class:`~onboard.errors.DiskError` where the disk is full, read-only or
    failing, and :class:`~onboard.errors.StateError` where somebody has to mend something.

    Args:
        path: the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size = 0
        self.writable = False
        self._fd = -1
        self._torn = False

    def open(self) -> bytes:
        """Open or make it, and its directory; its whole lines."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lines = self._opened(os.O_RDWR | os.O_APPEND | os.O_CREAT)
            _sync_directory(self.path.parent)
        except OSError as error:  # one that was open to be read, and locked, stays so
            raise disk_error(self.path, error) from error
        self.writable = True
        return lines

    def look(self) -> bytes:
        """Open one that cannot be written, to know what it says: its whole lines, or none."""
        try:
            return self._opened(os.O_RDONLY)
        except FileNotFoundError:
            return b""
        except OSError as error:
            raise disk_error(self.path, error) from error

    def close(self) -> None:
        """Release it."""
        if self._fd >= 0:
            os.close(self._fd)
        self._fd, self.writable = -1, False

    def append(self, lines: bytes) -> None:
        """Write lines; they are on the disk when this returns."""
        try:
            self._refuse_another()
            if self._torn:  # the disk was full in the middle of a line: start a clean one
                os.ftruncate(self._fd, self.size)
            self._torn = True
            _write_all(self._fd, lines)
            os.fsync(self._fd)
        except OSError as error:
            raise disk_error(self.path, error) from error
        self._torn = False
        self.size += len(lines)

    def has_room(self) -> None:
        """See whether the disk takes as much as a transaction; it does if this returns."""
        beside = self.path.with_suffix(self.path.suffix + ".try")
        fd = -1
        try:
            self._refuse_another()
            fd = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
            _write_all(fd, bytes(ROOM))
            os.fsync(fd)
        except OSError as error:
            raise disk_error(self.path, error) from error
        finally:
            if fd >= 0:
                os.close(fd)
            with contextlib.suppress(OSError):
                beside.unlink(missing_ok=True)

    def replace(self, lines: bytes) -> bool:
        """Have other lines in it; False: the disk does not, and the old file stays in use."""
        temporary = self.path.with_suffix(self.path.suffix + ".new")
        fd = -1
        try:
            fd = os.open(temporary, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_TRUNC, 0o600)
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _write_all(fd, lines)
            os.fsync(fd)
            temporary.rename(self.path)
        except OSError:
            if fd >= 0:
                os.close(fd)
                with contextlib.suppress(OSError):
                    temporary.unlink(missing_ok=True)
            return False
        os.close(self._fd)
        self._fd, self.size, self._torn = fd, len(lines), False
        with contextlib.suppress(OSError):  # either file is whole, whichever survives
            _sync_directory(self.path.parent)
        return True

    def _opened(self, flags: int) -> bytes:
        fd = os.open(self.path, flags | os.O_CLOEXEC, 0o600)
        self.close()
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(fd)
            raise HeldError(f"{self.path}: in use by another process") from None
        self._fd = fd
        if os.fstat(fd).st_size > LARGEST:
            self.close()
            raise StateError(f"{self.path}: larger than a journal can become; look at it")
        data = self.path.read_bytes()
        whole, _, torn = data.rpartition(b"\n")
        self.size = len(data) - len(torn)
        self._torn = bool(torn)
        return whole

    def _refuse_another(self) -> None:
        """The next start reads what is at the path, which is to be the file that is open.

        It is not any more where somebody has put the directory elsewhere, or an older state back.

        Raises:
            StateError: something else is there, or nothing.
            OSError: it cannot be seen.
        """
        try:
            same = os.path.samestat(os.fstat(self._fd), self.path.stat())
        except FileNotFoundError:
            same = False
        if not same:
            raise StateError(
                f"{self.path}: is not the journal that was opened; restart the service"
            )


def _write_all(fd: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(fd, view) :]


def _sync_directory(path: Path) -> None:
    fd = os.open(path, os.O_RDONLY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
