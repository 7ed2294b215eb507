"""One thread for what takes long: solving and the disk, in the order of asking.

Refining a flight takes seconds on a small companion, and the link must not wait for it.  The
thread is a daemon: a solver that hangs does not keep the process from ending.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, ParamSpec, TypeVar

from onboard.threads import Unawaited

P = ParamSpec("P")
T = TypeVar("T")


class Worker:
    """Runs calls one after the other; must be made on the loop that awaits them."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.get_running_loop()
        self._jobs: SimpleQueue[tuple[asyncio.Future[Any], Callable[[], Any]] | None] = (
            SimpleQueue()
        )
        self._ended = asyncio.Event()
        Unawaited(target=self._serve, name=name).start()

    async def call(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run it after all that was asked before; its result or exception."""
        future: asyncio.Future[T] = self._loop.create_future()
        self._jobs.put((future, lambda: function(*args, **kwargs)))
        return await future

    def dismiss(self) -> None:
        """Let the thread end after what was asked."""
        self._jobs.put(None)

    async def close(self) -> None:
        """Let the thread end after what was asked, and wait for that."""
        self.dismiss()
        await self._ended.wait()

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            future, function = job
            try:
                result = function()
            except BaseException as error:  # noqa: BLE001 - it is the caller's to handle
                self._answer(_fail, future, error)
            else:
                self._answer(_finish, future, result)
        self._answer(self._ended.set)

    def _answer(self, how: Callable[..., None], *args: Any) -> None:  # noqa: ANN401 - of any call
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits any more
            self._loop.call_soon_threadsafe(how, *args)


def _finish(future: asyncio.Future[Any], result: object) -> None:
    if not future.done():
        future.set_result(result)


def _fail(future: asyncio.Future[Any], error: BaseException) -> None:
    if not future.done():
        future.set_exception(error)
