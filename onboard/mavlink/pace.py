"""When a descriptor is read: in turns, far enough apart that many packets share a wake-up.

Small packets arrive by the hundred per second (a UART even hands over a few bytes at a time), and a
wake-up of the loop costs more than parsing what it brings.  So after each read the descriptor is
left alone for ``linger`` seconds and then drained, which bounds the wake-ups to ``1 / linger`` per
second and delays a message by ``linger`` at most; a quiet line goes back to being watched.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from onboard.mavlink import limits


class Pace:
    """Calls ``drain`` when the descriptor is readable, but not oftener than ``linger`` allows.

    ``drain`` reads and hands on ``BYTES_PER_TURN`` at the most, so that a flood leaves the loop to
    others in between; it returns how many there were.
    """

    def __init__(self, descriptor: int, drain: Callable[[], int], linger: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._descriptor = descriptor
        self._drain = drain
        self._linger = linger
        self._timer: asyncio.TimerHandle | None = None
        self._closed = False
        self._loop.add_reader(descriptor, self._readable)

    def change(self, linger: float) -> None:
        """From now on ``linger`` seconds; what waits already does not wait for longer than that."""
        self._linger = linger
        if self._closed or self._timer is None:
            return
        if self._timer.when() > self._loop.time() + linger:
            self._wait_for(linger)

    def now(self) -> None:
        """Drain what has come, if it is left alone; what is watched is read as it comes."""
        if self._timer is not None and not self._closed:
            self._timer.cancel()
            self._again()

    def _readable(self) -> None:
        size = self._drain()
        wait = self._wait(size)
        if wait > 0.0 and not self._closed:
            self._loop.remove_reader(self._descriptor)
            self._wait_for(wait)

    def _again(self) -> None:
        size = self._drain()
        if self._closed:
            return
        wait = self._wait(size)
        if size and wait > 0.0:
            self._wait_for(wait)
        else:
            self._timer = None
            self._loop.add_reader(self._descriptor, self._readable)

    def _wait_for(self, seconds: float) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(seconds, self._again)

    def _wait(self, size: int) -> float:
        """Until the next turn, s: short if this one may have left something."""
        return limits.FULL_TURN_PAUSE_S if size >= limits.BYTES_PER_TURN else self._linger

    def close(self) -> None:
        """Stop reading."""
        if self._closed:
            return
        self._closed = True
        self._loop.remove_reader(self._descriptor)
        if self._timer is not None:
            self._timer.cancel()
