"""A process that replays recordings, one after the other: jobs come in by standard input.

It ends when standard input does, so that none outlives who has started it.
"""

from __future__ import annotations

import os
import time

from onboard.batches.frames import Result, Share, next_job, send
from onboard.batches.job import done

TOLD_EVERY_S = 0.2
"""s between two reports of progress: as often as an eye follows [cost]."""


def main() -> None:
    """Take jobs until there are none."""
    jobs = os.fdopen(os.dup(0), "rb")
    said = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no message
    while (job := next_job(jobs)) is not None:
        told = time.monotonic()

        def progress(share: float) -> None:
            nonlocal told
            if time.monotonic() - told >= TOLD_EVERY_S:
                told = time.monotonic()
                send(said, Share(share))

        send(said, Result(done(job, progress)))


if __name__ == "__main__":
    main()
