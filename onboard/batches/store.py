"""Results on disk, so that a second run does only what is missing.

A file for each recording, named after the hash of its content and of what else decides on its
result, so that nothing in it is ever out of date: it is there or it is not.  Files begin with the
hash of what follows.  One that is torn, or of another kind, is ignored with a reason and written
anew.  A file is written beside its place and moved there: several processes, on several machines,
may write at once, and whoever is last has written the same.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

import msgspec

from onboard.answers.fleet.record import Record
from onboard.errors import UsageError

MAGIC = b"onboard fleet 1\n"
DIGEST = 64
"""Hexadecimal digits of SHA-256 [definition]."""


class Store:
    """A folder of results."""

    def __init__(self, folder: Path) -> None:
        """Take the folder; it is made when something is kept."""
        self.folder = folder

    def prepare(self) -> None:
        """Make the folder, and see that it can be written.

        Raises:
            UsageError: it cannot.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.folder):
                pass
        except OSError as error:
            raise UsageError(f"{self.folder}: cannot be written ({error.strerror})") from None

    def record(self, key: str, notes: list[str]) -> Record | None:
        """What is kept under a key; None if there is nothing that can be used."""
        payload = self._read(self._place(key, "record"), notes)
        if payload is None:
            return None
        try:
            return msgspec.msgpack.decode(payload, type=Record)
        except msgspec.DecodeError as error:
            notes.append(f"{self._place(key, 'record')}: not used, replayed anew ({error})")
            return None

    def page(self, key: str, notes: list[str]) -> bytes | None:
        """The report kept under a key, packed; None if there is none that can be used."""
        return self._read(self._place(key, "page"), notes)

    def keep(self, key: str, record: Record, page: bytes | None, notes: list[str]) -> None:
        """Write what came of a recording; what cannot be written is noted, and done again."""
        try:
            if page is not None:
                self._write(self._place(key, "page"), page)
            self._write(self._place(key, "record"), msgspec.msgpack.encode(record))
        except OSError as error:
            notes.append(f"{self.folder}: the result was not kept ({error.strerror})")

    def _place(self, key: str, kind: str) -> Path:
        # 256 folders: some file systems are slow with a million files in one.
        return self.folder / key[:2] / f"{key}.{kind}"

    def _read(self, file: Path, notes: list[str]) -> bytes | None:
        try:
            data = file.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            notes.append(f"{file}: not used, replayed anew ({error.strerror})")
            return None
        head, payload = data[: len(MAGIC) + DIGEST], data[len(MAGIC) + DIGEST :]
        if head != MAGIC + hashlib.sha256(payload).hexdigest().encode():
            notes.append(f"{file}: torn or not of this program, replayed anew")
            return None
        return payload

    def _write(self, file: Path, payload: bytes) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, beside = tempfile.mkstemp(dir=file.parent, prefix=".", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as out:
                out.write(MAGIC + hashlib.sha256(payload).hexdigest().encode())
                out.write(payload)
                out.flush()
                os.fsync(out.fileno())
            Path(beside).replace(file)
        except OSError:
            with contextlib.suppress(OSError):
                Path(beside).unlink()
            raise
