"""Starts in a row that came to nothing: each waits longer before it touches link, state and page.

A service that crashes once comes back as soon as systemd starts it again.  One that crashes at
every start asks a vehicle for its parameters, reads and writes its state, and fills the journal
every few seconds, for as long as there is power.  systemd's own growing delay (RestartSteps=, from
254 on) is no help: nothing sets it back after a start that went well, so that whoever has crashed
some times in a day waits longest for the crash in flight.

The count is a file in the unit's runtime directory, which outlives a restart and neither a stop nor
a boot.  What nobody foresaw counts, and what another program has (a port, a directory), which is
told at once: other failures with a sentence and a status of their own have waited for a heartbeat,
or are not started again.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from onboard.daemon.process.limits import LONGEST_WAIT_S, STARTS_AT_ONCE

FILE = "starts"


class Starts:
    """Counts starts of the service; does nothing where no manager starts it again."""

    def __init__(self, folder: Path | None) -> None:
        self._file = None if folder is None else folder / FILE
        self.failed = 0
        """Starts in a row before this one that came to nothing."""

    @classmethod
    def from_environment(cls) -> Starts:
        """In the runtime directory of the unit that started this process, if one did."""
        folder = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
        return cls(Path(folder) if folder else None)

    def begin(self) -> float:
        """Another start; how long it is to wait, s."""
        if self._file is None:
            return 0.0
        self.failed = self._read(self._file)
        with contextlib.suppress(OSError):
            self._file.write_text(str(self.failed + 1), "ascii")
        return waiting(self.failed)

    def over(self) -> None:
        """It has worked for a while, or ended as it was meant to: the next crash is the first."""
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.unlink(missing_ok=True)

    @staticmethod
    def _read(file: Path) -> int:
        try:
            return max(0, int(file.read_text("ascii")))
        except (OSError, ValueError):  # the first start, or a file of somebody else's
            return 0


def waiting(failed: int) -> float:
    """How long a start waits after so many that came to nothing, s: twice as long each time."""
    if failed < STARTS_AT_ONCE:
        return 0.0
    doublings = min(failed, 16)  # far beyond the longest wait, and no overflow
    return min(LONGEST_WAIT_S, 2.0**doublings)
