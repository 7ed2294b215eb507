"""Recordings of the link in files of bounded size, the oldest deleted."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

from onboard.errors import StateError
from onboard.mavlink.recorder import Recorder

_NAME = re.compile(r"(\d{8}-\d{6})-(\d{3,})\.tlog")


class RollingRecorder(Recorder):
    """A recorder that goes on in a new file past ``file_bytes`` and keeps ``keep`` files.

    Files are named by the time of their start, UTC; a counter tells files of one second apart.
    Where the clock was set back, names go on counting from the newest file: by its name, not by its
    time, the oldest is the one that is deleted.

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
        last, number = max(self._ours(), default=("", 0))[:2]
        if last < stamp:
            last, number = stamp, -1
        return self._directory / f"{last}-{number + 1:03d}.tlog"

    def _ours(self) -> list[tuple[str, int, Path]]:
        """Recordings of this or an earlier run by the order in which they were begun."""
        named = [(_NAME.fullmatch(path.name), path) for path in self._directory.glob("*.tlog")]
        return [(name[1], int(name[2]), path) for name, path in named if name]

    def _prune(self) -> None:
        for *_, path in sorted(self._ours())[: -self._keep]:
            if path != self.path:
                path.unlink(missing_ok=True)
