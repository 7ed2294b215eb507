"""Signals: once is asking to stop, twice is insisting; others end nothing.

A terminal that is closed sends SIGHUP, and others SIGUSR1 or SIGUSR2 to have logs begun anew or
something told.  Left to the system each of them would end the service in the middle of whatever it
does, and what was learned since the last save would be lost.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
from collections.abc import Callable, Iterator

logger = logging.getLogger(__name__)

STOPPING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
IDLE = (signal.SIGUSR1, signal.SIGUSR2)


@contextlib.contextmanager
def stop_signals(asked: Callable[[signal.Signals], None]) -> Iterator[None]:
    """Handle signals while the context lasts, in the task that enters it.

    Args:
        asked: called with each that asks to stop; the second also cancels the task: no more stages.
    """
    loop = asyncio.get_running_loop()
    task = asyncio.current_task()
    before = False

    def on_signal(number: signal.Signals) -> None:
        nonlocal before
        if before and task is not None:
            task.cancel()
        before = True
        asked(number)

    for number in STOPPING:
        loop.add_signal_handler(number, on_signal, number)
    for number in IDLE:
        loop.add_signal_handler(number, logger.info, "%s means nothing here", number.name)
    try:
        yield
    finally:
        for number in (*STOPPING, *IDLE):
            loop.remove_signal_handler(number)
