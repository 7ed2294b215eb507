"""Recordings of the link in files of bounded size, the oldest deleted."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from onboard.errors import StateError
from onboard.mavlink.recorder import Recorder


class RollingRecorder(Recorder):
    """A recorder that goes on in a new file past ``file_bytes`` and keeps ``keep`` files.

    Files are named by the time of their start, UTC; a counter tells files of one second apart.

    Raises:
        StateError: the directory cannot be made.
        EndpointError: the file cannot be created.
    """

    def __init__(
        self,
        directory: Path,
        *,
        keep: int,
        file_bytes: int,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StateError(f"{directory}: {error.strerror}") from None
        self._directory = directory
        self._keep = keep
        self._file_bytes = file_bytes
        self._wall_clock = wall_clock
        super().__init__(self._next_path())
        self._prune()

    def _append(self, block: bytearray) -> None:
        """On the recorder's thread: write, then roll over if the file has its size."""
        super()._append(block)
        if self._file.tell() >= self._file_bytes:
            self.path = self._next_path()
            following = self.path.open("ab", buffering=0)
            self._file.close()
            self._file = following
            self._prune()

    def _next_path(self) -> Path:
        stamp = time.strftime("%Y%m%d-%H%M%S", time.gmtime(self._wall_clock()))
        number = 0
        while True:
            path = self._directory / f"{stamp}-{number:03d}.tlog"
            if not path.exists():
                return path
            number += 1

    def _prune(self) -> None:
        files = sorted(self._directory.glob("*.tlog"), key=lambda path: path.stat().st_mtime)
        for path in files[: -self._keep]:
            if path != self.path:
                path.unlink(missing_ok=True)
