"""Raw recording of the link to a .tlog: what the daemon saw, frame by frame.

The format is that of ground stations: per frame 8 bytes of unix time in microseconds,
big-endian, then the frame as it was on the wire.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import struct
from collections.abc import Callable
from pathlib import Path

from onboard.errors import ConfigurationError, DiskError, disk_error
from onboard.mavlink import limits

_STAMP = struct.Struct(">Q")
_log = logging.getLogger(__name__)


class Recorder:
    """Appends frames to a file; all disk work happens on a worker thread.

    An SD card can stall a write for seconds, which the loop must not feel.  A disk that
    fails ends the recording, which is told once, and never the calibration.

    Raises:
        ConfigurationError: the file cannot be created.
        DiskError: it cannot, and that is the disk's fault.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.tell: Callable[[str], object] = _log.error
        """Where that is told, on the loop."""
        self.frames = 0
        self.dropped = 0
        self._pending = bytearray()
        try:
            self._file = path.open("ab", buffering=0)
        except OSError as error:
            refusal = disk_error(path, error)
            if isinstance(refusal, DiskError):
                raise refusal from None
            raise ConfigurationError(f"{path}: cannot record: {error.strerror}") from None
        self._failed = False
        self._job: asyncio.Future[None] | None = None

    def write(self, unix_time: float, frame: bytes) -> None:
        """Take one frame, received or sent at ``unix_time`` (s)."""
        if self._failed or len(self._pending) > limits.PENDING_LIMIT:
            self.dropped += 1
            return
        self._pending += _STAMP.pack(int(unix_time * 1e6))
        self._pending += frame
        self.frames += 1

    async def run(self) -> None:
        """Write to disk once a second until cancelled; then write the rest and close."""
        try:
            while True:
                await asyncio.sleep(limits.FLUSH_INTERVAL_S)
                await self._flush()
        finally:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(limits.CLOSE_TIMEOUT_S):
                    await self._flush()
                    self._file.close()

    async def _flush(self) -> None:
        await self._finish()
        if not self._pending:
            return
        block, self._pending = self._pending, bytearray()
        self._job = asyncio.get_running_loop().run_in_executor(None, self._append, block)
        await self._finish()

    async def _finish(self) -> None:
        """Wait for the block being written; a cancelled wait leaves it to the next call."""
        if self._job is None:
            return
        try:
            await asyncio.shield(self._job)
        except OSError as error:
            if not self._failed:
                self._failed = True
                self.tell(f"recording stopped: {self.path}: {error.strerror}")
        self._job = None

    def _append(self, block: bytearray) -> None:
        view = memoryview(block)
        while view:
            view = view[self._file.write(view) :]
