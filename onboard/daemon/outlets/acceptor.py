"""Accepts HTTP connections, few at a time, and parts with those that say nothing.

The loop's own server accepts without end: idle connections take every descriptor, and then nothing
else can be opened, no file for the saved sums either; what fails is logged as fast as it fails.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import resource
import socket
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from onboard.daemon.outlets import limits

logger = logging.getLogger(__name__)

EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


@dataclass(slots=True)
class _Visitor:
    """One connection: since when (the loop's time, s), whether a request came, whether it stays."""

    transport: asyncio.BaseTransport
    since: float
    asked: bool = False
    stays: bool = False


@dataclass(slots=True)
class Acceptor:
    """Accepts on one socket, which listens already and stays its owner's.

    ``protocol`` makes the protocol of a connection.  A visitor that sends no whole request in time,
    or has been there for long without being a viewer, is disconnected; where all places are taken,
    the one that has been silent longest makes room.
    """

    listening: socket.socket
    protocol: Callable[[], asyncio.Protocol]
    counters: Counter[str]
    _visitors: dict[asyncio.BaseTransport, _Visitor] = field(default_factory=dict)
    _arriving: set[asyncio.Task[None]] = field(default_factory=set)
    _sweeper: asyncio.Task[None] | None = None
    _retry: asyncio.TimerHandle | None = None
    _told_at: float | None = None

    def start(self) -> None:
        """Begin."""
        asyncio.get_running_loop().add_reader(self.listening, self._accept)
        self._sweeper = asyncio.create_task(self._sweep(), name="http visitors")

    def close(self) -> None:
        """Accept nobody any more; who is there stays."""
        asyncio.get_running_loop().remove_reader(self.listening)
        if self._retry is not None:
            self._retry.cancel()
        if self._sweeper is not None:
            self._sweeper.cancel()
        for task in self._arriving:
            task.cancel()

    def asked(self, transport: asyncio.BaseTransport | None, *, stays: bool = False) -> None:
        """A whole request has come; ``stays``: it is to be answered for as long as it lasts."""
        visitor = None if transport is None else self._visitors.get(transport)
        if visitor is not None:
            visitor.asked = True
            visitor.stays = stays

    @property
    def places(self) -> int:
        """How many may be there: most descriptors are kept for links and files."""
        allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        if allowed == resource.RLIM_INFINITY:
            return limits.CONNECTIONS_MAX
        return max(1, min(limits.CONNECTIONS_MAX, allowed // 4))

    def _accept(self) -> None:
        for _ in range(limits.ACCEPTED_PER_TURN):
            try:
                connection, _address = self.listening.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                self._exhausted(error)
                return
            if not self._has_room():
                self.counters["http_refused"] += 1
                connection.close()
                continue
            connection.settimeout(0.0)
            task = asyncio.create_task(self._welcome(connection))
            self._arriving.add(task)
            task.add_done_callback(self._arriving.discard)

    async def _welcome(self, connection: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        try:
            transport, _ = await loop.connect_accepted_socket(self.protocol, connection)
        except OSError:
            connection.close()
            return
        self._visitors[transport] = _Visitor(transport, loop.time())

    def _has_room(self) -> bool:
        """Whether one more may come; somebody who never asked for anything may have to go."""
        self._forget_gone()
        if len(self._visitors) + len(self._arriving) < self.places:
            return True
        silent = [visitor for visitor in self._visitors.values() if not visitor.asked]
        if not silent:
            return False
        self._part_with(min(silent, key=lambda visitor: visitor.since))
        return True

    def _exhausted(self, error: OSError) -> None:
        """No descriptor is left, or worse: try again in a second, and say so now and then."""
        self.counters["http_accept_failed"] += 1
        loop = asyncio.get_running_loop()
        if self._told_at is None or loop.time() - self._told_at > limits.TOLD_EVERY_S:
            self._told_at = loop.time()
            logger.warning("no connection can be accepted: %s", error.strerror or error)
        loop.remove_reader(self.listening)
        self._retry = loop.call_later(
            limits.ACCEPT_RETRY_S, loop.add_reader, self.listening, self._accept
        )

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(1.0)
            self._forget_gone()
            now = asyncio.get_running_loop().time()
            for visitor in list(self._visitors.values()):
                age = now - visitor.since
                silent = not visitor.asked and age > limits.FIRST_REQUEST_S
                if silent or (not visitor.stays and age > limits.VISIT_S):
                    self._part_with(visitor)

    def _part_with(self, visitor: _Visitor) -> None:
        self.counters["http_disconnected"] += 1
        del self._visitors[visitor.transport]
        if isinstance(visitor.transport, asyncio.WriteTransport):
            visitor.transport.abort()

    def _forget_gone(self) -> None:
        for transport in [t for t in self._visitors if t.is_closing()]:
            del self._visitors[transport]
