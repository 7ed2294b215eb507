"""Notices: what happened, one line each, for whoever wants to hear of it at once.

The log, the snapshot, a ground station's messages and a broker all take them from here.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from onboard.daemon.view.snapshot import Notice

logger = logging.getLogger(__name__)

KEPT = 50
Listener: TypeAlias = Callable[[Notice], None]


class Notices:
    """Keeps the last ones and tells listeners; ``wall_clock`` is Unix time, s."""

    def __init__(self, wall_clock: Callable[[], float]) -> None:
        self._wall_clock = wall_clock
        self._kept: deque[Notice] = deque(maxlen=KEPT)
        self._listeners: list[Listener] = []

    def listen(self, listener: Listener) -> None:
        """Have ``listener(notice)`` called for each from now on; it must not block."""
        self._listeners.append(listener)

    def post(self, kind: str, text: str, *, warning: bool = False) -> None:
        """Something happened; ``kind`` is for programs, ``text`` for people."""
        notice = Notice(at=self._wall_clock(), kind=kind, text=text, warning=warning)
        self._kept.append(notice)
        logger.log(logging.WARNING if warning else logging.INFO, "%s", text)
        for listener in self._listeners:
            listener(notice)

    @property
    def kept(self) -> tuple[Notice, ...]:
        """The last ones, oldest first."""
        return tuple(self._kept)
