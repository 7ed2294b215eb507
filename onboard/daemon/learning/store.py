"""The sums on disk: what the daemon has learned of each vehicle, across restarts.

With them goes what was found of the last flight: the flight itself is not kept.

One file per board (by the unique id that it tells, or, of those that tell none, by system id),
replaced whole: temporary file, fsync, rename, fsync of the directory.  A bounded number of them: a
board is easily made up, and the disk is the journal's too.  A file that is damaged or of
another version is set aside with the reason, never half used.  Whether sums are of the sensors that
are there now, a flight has to confirm (:mod:`onboard.core.estimate.agreement`).
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from zlib import crc32

import msgspec

from onboard.daemon.learning import limits
from onboard.errors import DiskError, StateError, disk_error

SCHEMA = 2
LARGEST = 64_000_000
"""bytes; the sums of a flight have some hundred thousand."""


class Saved(msgspec.Struct, frozen=True, kw_only=True):
    """The sums of one board; ``saved_at`` is Unix time, ``flight`` the last one, or empty.

    ``unjudged_s``: seconds that were flown by then and are in neither, for they were not diagnosed.
    """

    schema: int = SCHEMA
    version: str
    system_id: int
    saved_at: float
    sums: bytes
    check: int
    board: str = ""
    flight: bytes = b""
    unjudged_s: float = 0.0


class Store:
    """Reads and writes the files.

    Raises:
        StateError: the directory cannot be made, and that is not the disk's fault.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            refusal = disk_error(directory, error)
            if not isinstance(refusal, DiskError):  # which may take it later
                raise refusal from None

    def path(self, system_id: int, board: str = "") -> Path:
        """File of one board; ``board`` is its unique id in hex, empty if it tells none."""
        if not re.fullmatch("[0-9a-f]*", board):
            raise ValueError(f"{board!r} is no board's id")
        return self.directory / f"sums-{f'board-{board}' if board else system_id}.bin"

    def forget(self, system_id: int, board: str = "") -> None:
        """Delete what was saved for this board, under older names, too.

        Raises:
            StateError: the disk keeps it.
        """
        for path in (self.path(system_id, board), *self._older(system_id, board)):
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                why = f"{path}: {error.strerror}: it is there again at the next start"
                raise StateError(why) from None

    def _older(self, system_id: int, board: str) -> list[Path]:
        """Files of this board that have a system id in their names, too: that one's, the newest."""
        if not board:
            return []
        found = [path for path in self.directory.glob(f"sums-*-{board}.bin") if path.is_file()]
        ours = self.directory / f"sums-{system_id}-{board}.bin"
        found = [path for path in found if path != self.path(system_id, board)]
        return sorted(found, key=lambda path: (path != ours, -path.stat().st_mtime))

    def _rename(self, system_id: int, board: str) -> None:
        """Give this board's file, which may have an older name, its own."""
        path = self.path(system_id, board)
        older = self._older(system_id, board)
        if older and not path.exists():
            older[0].replace(path)

    def load(self, system_id: int, board: str = "") -> Saved | None:
        """What was saved for this board, None if nothing was.

        Raises:
            StateError: there is a file, but it cannot be used; it has been set aside.
        """
        path = self.path(system_id, board)
        try:
            self._rename(system_id, board)
            if path.stat().st_size > LARGEST:
                aside = self.set_aside(system_id, board)
                raise StateError(f"{path}: larger than sums can be, set aside as {aside}")
            saved = msgspec.msgpack.decode(path.read_bytes(), type=Saved)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StateError(f"{path}: {error.strerror}") from None
        except (msgspec.DecodeError, ValueError, RecursionError):
            raise StateError(
                f"{path}: damaged, set aside as {self.set_aside(system_id, board)}"
            ) from None
        if saved.schema != SCHEMA or crc32(saved.sums + saved.flight) != saved.check:
            why = "damaged" if saved.schema == SCHEMA else f"of version {saved.schema}"
            raise StateError(f"{path}: {why}, set aside as {self.set_aside(system_id, board)}")
        return saved

    def save(
        self,
        system_id: int,
        sums: bytes,
        *,
        version: str,
        saved_at: float,
        board: str = "",
        flight: bytes = b"",
        unjudged_s: float = 0.0,
    ) -> None:
        """Replace the file; it is on the disk when this returns.

        Raises:
            StateError: it could not be written; the file before is untouched.
        """
        path = self.path(system_id, board)
        saved = Saved(
            version=version,
            system_id=system_id,
            board=board,
            saved_at=saved_at,
            sums=sums,
            check=crc32(sums + flight),
            flight=flight,
            unjudged_s=unjudged_s,
        )
        temporary = path.with_suffix(".new")
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                self._make_room()
            with temporary.open("wb") as file:
                file.write(msgspec.msgpack.encode(saved))
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
            directory = os.open(self.directory, os.O_RDONLY)
            try:
                os.fsync(directory)
            finally:
                os.close(directory)
        except OSError as error:
            raise StateError(f"{path}: {error.strerror}") from None

    def _make_room(self) -> None:
        """One more board: those of which nothing was learned give way first, then the oldest."""
        files = [(path, path.stat()) for path in self.directory.glob("sums-*.bin")]
        files.sort(key=lambda file: (file[1].st_size > limits.NOTHING_LEARNED, file[1].st_mtime))
        for path, _ in files[: max(0, len(files) + 1 - limits.BOARDS_KEPT)]:
            path.unlink(missing_ok=True)

    def set_aside(self, system_id: int, board: str = "") -> str:
        """Rename the file so that it is not read again but can be looked at; its new name."""
        path = self.path(system_id, board)
        aside = path.with_suffix(".refused")
        try:
            path.replace(aside)
        except OSError as error:
            return f"(not renamed: {error.strerror})"
        return aside.name
