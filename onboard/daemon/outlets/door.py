"""The HTTP port of a service that mostly has no visitors.

The HTTP library takes 12 MB, and a vehicle in flight is rarely looked at: the port is bound at
the start, the library loaded when somebody knocks.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import logging
import socket
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING

from onboard.daemon.outlets import limits
from onboard.errors import NOT_OURS, ConfigurationError, UnavailableError

if TYPE_CHECKING:
    from onboard.daemon.outlets.control import ControlServer, Page
    from onboard.daemon.view.actions import Actions

logger = logging.getLogger(__name__)

ANY_ADDRESS = frozenset({"0.0.0.0", "::"})  # noqa: S104 - compared with, not bound to


class Door:
    """Listens; hands the socket to a :class:`~.control.ControlServer` when needed.

    ``pages`` add handlers to the application when it is made; one that imports what it needs only
    when it is called keeps that out of memory until then.  ``counters`` get what happens to
    connections.
    """

    def __init__(
        self,
        actions: Actions,
        *,
        address: str,
        port: int,
        token: str | None,
        pages: Iterable[Page] = (),
        counters: Counter[str] | None = None,
    ) -> None:
        self._counters = counters
        self._actions = actions
        self._address = address
        self._port = port
        self._token = token
        self._pages = tuple(pages)
        self._socket: socket.socket | None = None
        self._opening: asyncio.Task[None] | None = None
        self._server: ControlServer | None = None

    @property
    def url(self) -> str:
        """Where it listens, with the port that it really got."""
        port = self._port if self._socket is None else self._socket.getsockname()[1]
        host = "127.0.0.1" if self._address in ANY_ADDRESS else self._address
        return f"http://{f'[{host}]' if ':' in host else host}:{port}"

    def listen(self) -> None:
        """Bind the port.

        Raises:
            UnavailableError: another program has it, or the address is none of ours (yet).
            ConfigurationError: it cannot be had at all.
        """
        try:
            self._socket = bound(self._address, self._port)
        except OSError as error:
            where = f"{self._address}:{self._port}"
            if error.errno in NOT_OURS:
                raise UnavailableError(f"[http] {where}: {error.strerror}") from None
            raise ConfigurationError(f"[http] {where}: {error.strerror or error}") from None
        asyncio.get_running_loop().add_reader(self._socket, self._knock)

    def publish(self) -> None:
        """Send a new snapshot to whoever watches."""
        if self._server is not None:
            self._server.publish()

    async def close(self) -> None:
        """Close all connections and the port."""
        if self._socket is None:
            return
        asyncio.get_running_loop().remove_reader(self._socket)
        if self._opening is not None:
            self._opening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._opening
        if self._server is not None:
            await self._server.stop()
            self._server = None
        self._socket.close()
        self._socket = None

    def _knock(self) -> None:
        """Somebody connects: they wait in the socket's queue while the library is loaded."""
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket)
            self._opening = asyncio.create_task(self._open(self._socket), name="open the door")

    async def _open(self, listening: socket.socket) -> None:
        try:
            await self._serve(listening)
        except OSError as error:  # no descriptor left, say: the next who knocks tries again
            logger.warning("the page cannot be served yet: %s", error.strerror or error)
            await asyncio.sleep(limits.ACCEPT_RETRY_S)
            asyncio.get_running_loop().add_reader(listening, self._knock)

    async def _serve(self, listening: socket.socket) -> None:
        control = await asyncio.to_thread(importlib.import_module, "onboard.daemon.outlets.control")
        server: ControlServer = control.ControlServer(
            self._actions, token=self._token, pages=self._pages, counters=self._counters
        )
        await server.start(listening)
        self._server = server


def bound(address: str, port: int) -> socket.socket:
    """A listening socket.

    Raises:
        OSError: no such address, or the port is taken.
    """
    family, kind, number, _, where = socket.getaddrinfo(
        address, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    listening = socket.socket(family, kind, number)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.settimeout(0.0)
        listening.bind(where)
        listening.listen(64)
    except BaseException:
        listening.close()
        raise
    return listening
