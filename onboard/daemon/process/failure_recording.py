"""From the first failure of the estimator on the link is recorded, whether or not [recording] is.

Of a mistake of ours that nobody has seen before, the flight that it is made on is what is needed,
and it is gone with the first one.  The next one is kept: in a place of its own and of a bounded
size, so that nothing which somebody wants recorded gives way to it.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

from onboard.daemon.process import limits
from onboard.daemon.setup.recording import RollingRecorder
from onboard.errors import OnboardError
from onboard.mavlink.link import Link

logger = logging.getLogger(__name__)


class FailureRecording:
    """Begins when it is told to; what records already goes on as it does.

    Args:
        link: what is recorded.
        directory: where files go.
        wall_clock: Unix time, s.
    """

    def __init__(self, link: Link, directory: Path, wall_clock: Callable[[], float]) -> None:
        self._link = link
        self._directory = directory
        self._wall_clock = wall_clock
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Record from here on; a disk that takes nothing is told, and stops nothing."""
        if self._link.recorder is not None:
            return
        try:
            recorder = RollingRecorder(
                self._directory,
                keep=limits.FAILURE_FILES,
                file_bytes=limits.FAILURE_FILE_BYTES,
                wall_clock=self._wall_clock,
            )
        except OnboardError as error:
            logger.error("%s", error)  # noqa: TRY400 - a full disk is no bug of ours
            return
        self._link.recorder = recorder
        self._task = asyncio.create_task(recorder.run(), name="recording of a failure")
        logger.warning("the link is recorded from here on: %s", recorder.path)

    async def close(self) -> None:
        """Write what is left."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
