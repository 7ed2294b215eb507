"""Bytes that were read from a datagram socket and not handed on yet: a queue for each sender.

A socket's own buffer is first come, first served: who sends most has most of it.  So it is emptied
as fast as it fills, which costs little, and what came waits here, each sender for itself.  Queues
are served in turn, the vehicle's before all others; what one sends beyond its queue is lost to that
one alone.
"""

from __future__ import annotations

from collections.abc import Callable

from onboard.mavlink import limits
from onboard.mavlink.peers import Address


def _nobody(_: Address | None) -> bool:
    return False


class Waiting:
    """The queues.

    Args:
        first: whether a sender goes before all others (None: the only one of a connected socket).
    """

    def __init__(self, first: Callable[[Address | None], bool] = _nobody) -> None:
        self.refused = 0
        """Datagrams for which there was no room."""
        self.favourite: Address | None = None
        """Who went before all others last."""
        self._goes_first = first
        self._first: dict[Address | None, bytearray] = {}
        self._others: dict[Address | None, bytearray] = {}

    def __bool__(self) -> bool:
        return bool(self._first or self._others)

    def put(self, source: Address | None, data: memoryview) -> None:
        """A datagram has come."""
        if not data:
            return
        queue = self._first.get(source) or self._others.get(source)
        if queue is None:
            first = self._goes_first(source)
            if not first and len(self._others) >= limits.SENDERS_WAITING:
                self.refused += 1
                return
            if first:
                self.favourite = source
            (self._first if first else self._others)[source] = bytearray(data)
        elif len(queue) + len(data) > limits.WAITING_BYTES:
            self.refused += 1
        else:
            queue += data

    def take(self, size: int) -> tuple[Address | None, bytes] | None:
        """Whose turn it is, and at most so many bytes of that sender; None if nothing waits."""
        queues = self._first or self._others
        if not queues:
            return None
        source = next(iter(queues))
        queue = queues.pop(source)
        turn = bytes(queue[:size])
        del queue[:size]
        if queue:
            queues[source] = queue  # behind the others
        return source, turn
