"""Linear algebra in one thread: its matrices are small, and a second thread mostly waits busily.

And the end of a process in which a thread still computes.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import threading
from collections.abc import Callable, MutableMapping
from typing import NoReturn

ONE_THREAD = (
    "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)  # fmt: skip
"""What libraries look at when they are loaded."""


def in_one_thread(environment: MutableMapping[str, str]) -> None:
    """Ask for one thread where nobody has asked for another number; before numpy is imported."""
    for name in ONE_THREAD:
        environment.setdefault(name, "1")


class Unawaited(threading.Thread):
    """A thread for which its process does not wait when it ends."""

    def __init__(self, *, target: Callable[[], None], name: str) -> None:
        super().__init__(target=target, name=name, daemon=True)


def leave(status: int) -> NoReturn:
    """End the process with this status.

    Where an unawaited thread still computes, it ends at once: the numeric library gives its memory
    back at the end of a process, and a thread that is in it then would crash the process.
    """
    if not any(isinstance(thread, Unawaited) for thread in threading.enumerate()):
        sys.exit(status)
    logging.shutdown()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # nobody reads any more
            stream.flush()
    os._exit(status)
