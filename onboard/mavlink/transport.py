"""Byte transports on the asyncio loop: UDP, TCP and serial behind one small protocol.

All three read from a file descriptor that the loop watches, in turns (:mod:`.pace`): after each
read it is left alone for ``linger`` seconds, which delays a message by so much at most.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import math
import os
import socket
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

from onboard.errors import NOT_OURS, UnavailableError
from onboard.mavlink import limits
from onboard.mavlink.endpoint import Endpoint, EndpointError, EndpointKind
from onboard.mavlink.pace import Pace
from onboard.mavlink.peers import Address
from onboard.mavlink.serialport import open_serial
from onboard.mavlink.waiting import Waiting

FORBIDDEN = (errno.EACCES, errno.EPERM)

Receive = Callable[[bytes, Address | None], None]
Lost = Callable[[str], None]
First = Callable[[Address | None], bool]


class Transport(Protocol):
    """What the link needs of a connection.

    ``dropped`` counts writes that could not be sent, ``refused`` reads that had nowhere to wait.
    """

    dropped: int

    @property
    def refused(self) -> int:
        """Reads that had nowhere to wait: a flood's, or a crowd's."""

    def write(self, data: bytes, to: Sequence[Address] = ()) -> None:
        """Send without waiting; drops and counts when the line does not take it.

        ``to``: addresses, for a listening datagram socket; all others have one other end.
        """

    def pace(self, linger: float) -> None:
        """From now on a message waits for ``linger`` s at most, one that has come already, too."""

    def read(self) -> None:
        """Read what has come, without waiting for its time."""

    def close(self) -> None:
        """Let go of the descriptor; nothing is received after this.  May be called twice."""


async def open_transport(
    endpoint: Endpoint,
    receive: Receive,
    lost: Lost,
    *,
    linger: float = limits.LINGER_S,
    first: First | None = None,
) -> Transport:
    """Open an endpoint.

    Args:
        endpoint: where to.
        receive: called with what was read and the address that it came from (None: the only one).
        lost: called once with the reason when the connection breaks by itself.
        linger: longest delay of a message, s, until :meth:`Transport.pace` says otherwise.
        first: whether what an address sent to a listening socket goes before what others sent.

    Raises:
        EndpointError: no permission, or no serial device.
        UnavailableError: port in use, or no such local address (yet).
        OSError: the peer or device is not there (now): worth another try.
    """
    if endpoint.kind is EndpointKind.SERIAL:
        return StreamTransport(open_serial(endpoint), receive, lost, linger)
    loop = asyncio.get_running_loop()
    kind = socket.SOCK_STREAM if endpoint.kind is EndpointKind.TCP else socket.SOCK_DGRAM
    async with asyncio.timeout(limits.CONNECT_TIMEOUT_S):
        family, _, _, _, address = (
            await loop.getaddrinfo(endpoint.host or "0.0.0.0", endpoint.port, type=kind)  # noqa: S104 - the user asked for all interfaces
        )[0]
        sock = socket.socket(family, kind)
        try:
            sock.settimeout(0.0)
            if endpoint.kind is EndpointKind.TCP:
                await loop.sock_connect(sock, address)
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
                return StreamTransport(sock, receive, lost, linger)
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, limits.SOCKET_BYTES)
            if endpoint.kind is EndpointKind.UDP_IN:
                sock.bind(address)
                return DatagramTransport(sock, receive, linger, listening=True, first=first)
            sock.connect(address)
            return DatagramTransport(sock, receive, linger)
        except OSError as error:
            sock.close()
            if endpoint.kind is EndpointKind.TCP:
                raise
            if error.errno in NOT_OURS:
                what = "port in use" if error.errno == errno.EADDRINUSE else error.strerror
                raise UnavailableError(f"{endpoint}: {what}") from None
            if error.errno in FORBIDDEN:
                raise EndpointError(f"{endpoint}: {error.strerror}") from None
            raise
        except BaseException:
            sock.close()
            raise


class DatagramTransport:
    """UDP, connected (``udpout``) or listening (``udpin``: who is answered is the caller's to say).

    UDP is never lost: an ICMP refusal only says that nobody listens yet.
    """

    def __init__(
        self,
        sock: socket.socket,
        receive: Receive,
        linger: float,
        *,
        listening: bool = False,
        first: First | None = None,
    ) -> None:
        self.dropped = 0
        self.waiting = Waiting() if first is None else Waiting(first)
        self._socket = sock
        self._receive = receive
        self._listening = listening
        self._linger = linger
        self._buffer = memoryview(bytearray(limits.READ_SIZE))
        self._closed = False
        self._line: socket.socket | None = None
        self._line_of: Address | None = None
        self._line_pace: Pace | None = None
        self._pace = Pace(sock.fileno(), partial(self._drain, sock), linger)

    @property
    def refused(self) -> int:
        """Datagrams for which there was no room in their sender's queue."""
        return self.waiting.refused

    @property
    def port(self) -> int:
        """The local port, of interest where the system chose it."""
        return int(self._socket.getsockname()[1])

    def write(self, data: bytes, to: Sequence[Address] = ()) -> None:
        """Send one datagram to the peer, or to each of these."""
        if self._closed or (self._listening and not to):
            self.dropped += 1
        elif self._listening:
            for address in to:
                self._send(data, address)
        else:
            self._send(data, None)

    def pace(self, linger: float) -> None:
        """See :class:`Transport`."""
        self._linger = linger
        for pace in self._paces():
            pace.change(linger)

    def read(self) -> None:
        """See :class:`Transport`."""
        for pace in self._paces():
            pace.now()

    def _paces(self) -> tuple[Pace, ...]:
        return (self._pace,) if self._line_pace is None else (self._line_pace, self._pace)

    def close(self) -> None:
        """Stop and release the port."""
        if not self._closed:
            self._closed = True
            self._close_line()
            self._pace.close()
            self._socket.close()

    def _send(self, data: bytes, address: Address | None) -> None:
        try:
            if address is None:
                self._socket.send(data)
            else:
                self._socket.sendto(data, address)
        except OSError:
            self.dropped += 1

    def _drain(self, sock: socket.socket) -> int:
        """Read what there is and hand on a turn of it, each sender's bytes by themselves."""
        more = self._read(sock)
        left = limits.BYTES_PER_TURN
        while left and not self._closed and (turn := self.waiting.take(left)):
            source, data = turn
            left -= len(data)
            self._receive(data, source)
        if self.waiting.favourite != self._line_of and not self._closed:
            self._open_line(self.waiting.favourite)
        return limits.BYTES_PER_TURN if more or self.waiting else limits.BYTES_PER_TURN - left

    def _read(self, sock: socket.socket) -> bool:
        """Empty a socket; whether it was too much for one turn."""
        for _ in range(limits.DATAGRAMS_PER_TURN):
            try:
                size, address = sock.recvfrom_into(self._buffer)
            except BlockingIOError:
                return False
            except OSError:
                continue  # an ICMP error about something we sent
            self.waiting.put(address if self._listening else None, self._buffer[:size])
        return True

    def _open_line(self, address: Address | None) -> None:
        """Have the system keep what this one sends apart from what all others send."""
        self._close_line()
        self._line_of = address
        line = None if address is None else line_of_its_own(self._socket, address)
        if line is not None:
            self._line = line
            self._line_pace = Pace(line.fileno(), partial(self._drain, line), self._linger)

    def _close_line(self) -> None:
        if self._line is not None and self._line_pace is not None:
            self._line_pace.close()
            self._line.close()
            self._line = self._line_pace = None


def line_of_its_own(sock: socket.socket, address: Address) -> socket.socket | None:
    """A second socket on the port of ``sock`` that gets what one address sends, in its own buffer.

    Without it a flood from elsewhere fills the only buffer while this process has to wait for a
    core, and the vehicle's datagrams are lost with the others'.  Sharing the port is allowed for
    this moment only: another program that wants it is still told that it is taken.  None where the
    system does not do that.
    """
    line = socket.socket(sock.family, sock.type)
    try:
        line.settimeout(0.0)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, limits.SOCKET_BYTES)
        for one in (sock, line):
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind(sock.getsockname())
        line.connect(address)
    except OSError:
        line.close()
        return None
    finally:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
    return line


class StreamTransport:
    """TCP or serial: a byte stream on one descriptor (``source``: a socket or a raw one)."""

    def __init__(
        self, source: socket.socket | int, receive: Receive, lost: Lost, linger: float
    ) -> None:
        self.dropped = 0
        self._socket = None if isinstance(source, int) else source
        self._descriptor = source if isinstance(source, int) else source.fileno()
        self._receive = receive
        self._lost = lost
        self._loop = asyncio.get_running_loop()
        self._waiting = bytearray()
        self._closed = False
        self._longest = math.inf if self._socket is not None else limits.SERIAL_LINGER_S
        self._pace = Pace(self._descriptor, self._drain, min(linger, self._longest))

    @property
    def refused(self) -> int:
        """None: what a stream brings waits in the system until it is read."""
        return 0

    def write(self, data: bytes, to: Sequence[Address] = ()) -> None:  # noqa: ARG002 - one other end
        """Send; what the line does not take at once waits, up to a limit."""
        if self._closed or len(self._waiting) + len(data) > limits.WRITE_LIMIT:
            self.dropped += 1
            return
        idle = not self._waiting
        self._waiting += data
        if idle:
            self._flush()

    def pace(self, linger: float) -> None:
        """See :class:`Transport`."""
        self._pace.change(min(linger, self._longest))

    def read(self) -> None:
        """See :class:`Transport`."""
        self._pace.now()

    def close(self) -> None:
        """Stop and release the descriptor."""
        if self._closed:
            return
        self._closed = True
        self._pace.close()
        self._loop.remove_writer(self._descriptor)
        if self._socket is not None:
            self._socket.close()
        else:
            os.close(self._descriptor)

    def _flush(self) -> None:
        try:
            sent = os.write(self._descriptor, self._waiting)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self._break(error.strerror or str(error))
            return
        del self._waiting[:sent]
        if self._waiting:
            self._loop.add_writer(self._descriptor, self._flush)
        else:
            self._loop.remove_writer(self._descriptor)

    def _drain(self) -> int:
        try:
            data = os.read(self._descriptor, limits.BYTES_PER_TURN)
        except BlockingIOError:
            return 0
        except OSError as error:
            self._break(error.strerror or str(error))
            return 0
        if not data:
            self._break("closed by the other side")
            return 0
        self._receive(data, None)
        return len(data)

    def _break(self, reason: str) -> None:
        if not self._closed:
            self.close()
            # Not from within write(): the caller may be iterating over its connections.
            self._loop.call_soon(self._lost, reason)
