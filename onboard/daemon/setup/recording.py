"""Recordings of the link in files of bounded size, the oldest deleted."""

from __future__ import annotations

import contextlib
import errno
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

from onboard.errors import disk_error
from onboard.mavlink.recorder import Recorder

LEFT_FREE = 50_000_000
"""bytes of the disk that are the journal's, the sums' and other programs': without a journal
nothing is written to the vehicle [cost]."""
_NAME = re.compile(r"(\d{8}-\d{6})-(\d{3,})\.tlog")


class RollingRecorder(Recorder):
    """A recorder that goes on in a new file past ``file_bytes`` and keeps ``keep`` files.

    The last of the disk's room is not taken: before that the oldest recordings go, and when this
    one is the only one left, it ends.

    Files are named by the time of their start, UTC; a counter tells files of one second apart.
    Where the clock was set back, names go on counting from the newest file: by its name, not by its
    time, the oldest is the one that is deleted.

    Raises:
        StateError: the directory cannot be made.
        ConfigurationError: the file cannot be created.
        DiskError: either, and that is the disk's fault.
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
            raise disk_error(directory, error) from None
        self._directory = directory
        self._keep = keep
        self._file_bytes = file_bytes
        self._wall_clock = wall_clock
        super().__init__(self._next_path())
        with contextlib.suppress(OSError):  # it is tried again at the next file
            self._prune()

    def _append(self, block: bytearray) -> None:
        """On the recorder's thread: write, then roll over if the file has its size."""
        self._make_room(len(block))
        super()._append(block)
        if self._file.tell() >= self._file_bytes:
            self.path = self._next_path()
            following = self.path.open("ab", buffering=0)
            self._file.close()
            self._file = following
            self._prune()

    def _make_room(self, size: int) -> None:
        while shutil.disk_usage(self._directory).free < LEFT_FREE + size:
            older = [path for *_, path in sorted(self._ours()) if path != self.path]
            if not older:
                text = f"less than {LEFT_FREE // 1_000_000} MB of the disk are free"
                raise OSError(errno.ENOSPC, text)
            older[0].unlink(missing_ok=True)

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
