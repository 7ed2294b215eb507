"""SIGTERM and SIGINT: once is asking, twice is insisting."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def stop_signals(asked: Callable[[signal.Signals], None]) -> Iterator[None]:
    """Handle both while the context lasts, in the task that enters it.

    Args:
        asked: called with each of them; the second also cancels the task: no more stages.
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

    handled = (signal.SIGTERM, signal.SIGINT)
    for number in handled:
        loop.add_signal_handler(number, on_signal, number)
    try:
        yield
    finally:
        for number in handled:
            loop.remove_signal_handler(number)
