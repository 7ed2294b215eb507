"""An event loop whose clock jumps to the next timer: sleeping takes no time.

Sockets on loopback do no harm: what is sent there has arrived when the sender returns, so a loop
that finds nothing to read may let time jump.  While a thread is at work it may not, for nobody
knows when that will have done: time then passes as it does for everybody.
"""

from __future__ import annotations

import asyncio
import contextlib
import selectors
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import Executor

    Ready = list[tuple[selectors.SelectorKey, int]]

T = TypeVar("T")


class _Selector(selectors.DefaultSelector):
    loop: VirtualTimeLoop

    def select(self, timeout: float | None = None) -> Ready:
        """What is ready now; if nothing is, time passes at once."""
        ready = super().select(0)
        if ready or timeout == 0.0:
            return ready
        if self.loop.threads:
            began = time.monotonic()
            ready = super().select(timeout)
            self.loop.now += time.monotonic() - began
        elif timeout is None:
            raise RuntimeError("nothing will ever happen any more")
        elif timeout > 0.0:
            self.loop.now += timeout
        return ready


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """Sleeping takes no time; ``now`` is how much has been slept, s.

    ``threads`` counts the threads at work, of which it knows its executors' and those that are
    told with :meth:`thread`.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self.threads = 0
        selector = _Selector()
        selector.loop = self
        super().__init__(selector)

    def time(self) -> float:
        """The loop's clock, s."""
        return self.now

    @contextlib.contextmanager
    def thread(self) -> Iterator[None]:
        """While this lasts a thread is at work, which will wake the loop."""
        self.threads += 1
        try:
            yield
        finally:
            self.threads -= 1

    def run_in_executor(  # type: ignore[override]  # typeshed has the loop's own type variables
        self,
        executor: Executor | None,
        func: Callable[..., T],
        *args: Any,  # noqa: ANN401
    ) -> asyncio.Future[T]:
        """As every loop does it; until it is done a thread is at work."""
        future: asyncio.Future[T] = super().run_in_executor(executor, func, *args)
        self.threads += 1
        future.add_done_callback(self._thread_ended)
        return future

    def _thread_ended(self, _future: asyncio.Future[Any]) -> None:
        self.threads -= 1

    async def shutdown_default_executor(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401
        """As every loop does it."""
        with self.thread():
            await super().shutdown_default_executor(*args, **kwargs)
