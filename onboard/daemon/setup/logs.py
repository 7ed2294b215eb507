"""A log that cannot be flooded: of one kind of line so many in a while, then how many more."""

from __future__ import annotations

import logging
import time
from collections import OrderedDict
from collections.abc import Callable

LINES = 120
"""Lines of one kind (same place in the program) in one period."""
PERIOD_S = 60.0
KINDS_MAX = 1000
"""Kinds that are remembered: the program has fewer."""


class Restrained(logging.Filter):
    """Lets ``lines`` of each kind through in ``period_s``; the first of the next period says more.

    ``clock`` is monotonic, s.
    """

    def __init__(
        self,
        lines: int = LINES,
        period_s: float = PERIOD_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self._lines = lines
        self._period_s = period_s
        self._clock = clock
        self._kinds: OrderedDict[tuple[str, str, int], tuple[float, int]] = OrderedDict()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether this line is written."""
        kind = (record.name, record.pathname, record.lineno)
        now = self._clock()
        since, count = self._kinds.get(kind, (now, 0))
        if now - since >= self._period_s:
            if count > self._lines:
                record.msg = f"{record.getMessage()} ({count - self._lines} more were not written)"
                record.args = ()
            since, count = now, 0
        self._kinds[kind] = since, count + 1
        self._kinds.move_to_end(kind)
        while len(self._kinds) > KINDS_MAX:
            self._kinds.popitem(last=False)
        return count < self._lines
