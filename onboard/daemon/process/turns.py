"""How long the event loop was away: a selector that measures the turns between its waits.

While a handler runs nothing else is heard or fed, the service manager's watchdog neither.  Each
turn is measured where the loop itself waits, so that none is missed and none costs a wake-up.
"""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable
from dataclasses import dataclass

from onboard.daemon.process import limits


@dataclass(slots=True)
class Turns:
    """Stalls so far, and the longest turn, s."""

    stalls: int = 0
    worst_s: float = 0.0

    def note(self, seconds: float) -> None:
        """A turn took this long."""
        if seconds > limits.STALL_S:
            self.stalls += 1
            self.worst_s = max(self.worst_s, seconds)


class MeteredSelector(selectors.DefaultSelector):
    """Hands ``turns`` the time from each return of :meth:`select` to its next call."""

    def __init__(self, turns: Turns, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._turns = turns
        self._clock = clock
        self._began: float | None = None

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait, as the base class does."""
        if self._began is not None:
            self._turns.note(self._clock() - self._began)
        ready = super().select(timeout)
        self._began = self._clock()
        return ready


class MeteredLoop(asyncio.SelectorEventLoop):
    """A loop whose ``turns`` are measured."""

    def __init__(self) -> None:
        self.turns = Turns()
        super().__init__(MeteredSelector(self.turns))


def turns_here() -> Turns:
    """Of the running loop; of a loop that does not measure them, none."""
    loop = asyncio.get_running_loop()
    return loop.turns if isinstance(loop, MeteredLoop) else Turns()
