"""Coroutine tests on an event loop whose clock jumps to the next timer."""

from __future__ import annotations

import asyncio
import functools

from sitl.virtual_time import VirtualTimeLoop


def virtual_time(test):
    """Run a coroutine test on such a loop."""

    @functools.wraps(test)
    def run(*args, **kwargs):
        with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
            runner.run(test(*args, **kwargs))

    return run
