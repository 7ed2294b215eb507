"""The broker's line: aiomqtt's client, which hangs up on what is more than anything said to us.

The library would collect a packet of up to 256 MB before anybody sees how long it is, and a
retained one comes again with every connection.  Messages of quality 2, which we ask nobody for, it
would keep until the broker releases them: 65,535 of them.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import aiomqtt

from onboard.daemon.mqtt import limits


class Client(aiomqtt.Client):
    """As the library's, all arguments too."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - the library's
        super().__init__(*args, **kwargs)
        self.overlong = False
        """Whether it has hung up because of that."""
        receive = self._client._sock_recv  # noqa: SLF001 - it has no limit of its own

        def receive_within_limits(bufsize: int) -> bytes:
            if bufsize > limits.PACKET_MAX:
                self.overlong = True
                raise ConnectionError(f"a packet of {bufsize} bytes")
            if len(self._client._in_messages) > limits.COMMANDS_WAITING:  # noqa: SLF001 - as above
                raise ConnectionError("messages that are never released")
            return receive(bufsize)

        # What is left of a packet is asked for at once, so this is its length.  There is no public
        # way in: the library makes room for it before it calls anybody.
        self._client._sock_recv = receive_within_limits  # type: ignore[method-assign]  # noqa: SLF001

    async def __aexit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        tb: TracebackType | None,
    ) -> None:
        """As the library's; why the line was lost is told by whoever used it."""
        if self._disconnected.done() and not self._disconnected.cancelled():
            self._disconnected.exception()
        await super().__aexit__(exc_type, exc, tb)
