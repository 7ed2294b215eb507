"""The built-in autopilot on real sockets: UDP and TCP, several clients, any speed.

The autopilot lives in its own time; one task moves it on by ``speedup`` seconds a second and
carries bytes both ways.  Where the machine is too slow, the simulation runs slower than
asked: it never catches up in a burst, which no real autopilot does either.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Protocol, cast

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.autopilot import Autopilot
from sitl.builtin.impairment import Impairment
from sitl.builtin.links import Link
from sitl.builtin.messages import Message, packed
from sitl.virtual_time import VirtualTimeLoop

TICK = 0.005
"""Wall-clock seconds between steps of the simulation."""
SLOWEST_PACE, FASTEST_PACE = 0.01, 100.0
SLOWEST = 0.2
"""Backlog that is forgotten instead of being caught up, wall-clock s."""


class Driver(Protocol):
    """Something that flies: a mission, or a test."""

    def step(self, autopilot: Autopilot) -> None:
        """Called between steps of the simulation."""


class _Client:
    """One peer: its link, its frames, its way back."""

    def __init__(self, link: Link, send: Callable[[bytes], None], system: int) -> None:
        self.link = link
        self.send = send
        self.inbox: deque[Message] = deque()
        self.forwarded: list[bytes] = []
        self._packer = mav.MAVLink(None, srcSystem=system, srcComponent=1)
        self._parser = mav.MAVLink(None)
        self._parser.robust_parsing = True

    def feed(self, data: bytes) -> None:
        """Bytes that came in."""
        self.inbox.extend(self._parser.parse_buffer(data) or [])

    def frames(self) -> list[bytes]:
        """Frames to be sent now."""
        waiting, self.link.outbox = self.link.outbox, []
        others, self.forwarded = self.forwarded, []
        return others + [packed(message, self._packer) for _, message in waiting]


class Server:
    """Runs an autopilot in real time, or ``speedup`` times faster, for any number of clients.

    Args:
        autopilot: the machine to run.
        speedup: simulated seconds a second.
        driver: asked once a step what to do next (a :class:`~sitl.builtin.mission.Mission`).
        impairment: what happens to frames on their way, in both directions.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        *,
        speedup: float = 1.0,
        driver: Driver | None = None,
        impairment: Impairment | None = None,
    ) -> None:
        if speedup <= 0.0:
            raise ValueError(f"speedup has to be positive, not {speedup}")
        self.autopilot = autopilot
        autopilot.parameters.load({"SIM_SPEEDUP": speedup})
        self.driver = driver
        self.impairment = impairment or Impairment()
        self._clients: list[_Client] = []
        self._joining: list[_Client] = []
        self._leaving: list[_Client] = []
        self._requests: deque[Callable[[Autopilot], None]] = deque()
        self._closers: list[Callable[[], object]] = []
        self._handlers: set[asyncio.Task[None]] = set()

    @property
    def speedup(self) -> float:
        """Simulated seconds a second: SIM_SPEEDUP, which any client may change."""
        return min(max(self.autopilot.parameters["SIM_SPEEDUP"], SLOWEST_PACE), FASTEST_PACE)

    async def listen_tcp(self, host: str = "127.0.0.1", port: int = 0) -> int:
        """Accepts TCP clients, as SITL's first port does; returns the port.

        Raises:
            OSError: the address cannot be had.
        """
        server = await asyncio.start_server(self._serve_tcp, host, port)
        self._closers.append(server.close)
        return int(server.sockets[0].getsockname()[1])

    async def listen_udp(self, host: str = "127.0.0.1", port: int = 0) -> int:
        """Waits for datagrams; each address that speaks is a client.  Returns the port.

        Raises:
            OSError: the address cannot be had.
        """
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(
            lambda: _Datagrams(self), local_addr=(host, port)
        )
        self._closers.append(transport.close)
        return int(transport.get_extra_info("sockname")[1])

    async def connect_udp(self, host: str, port: int) -> None:
        """Sends to a ground station that listens, as an autopilot's telemetry radio does.

        Raises:
            OSError: no such address.
        """
        loop = asyncio.get_running_loop()
        transport, protocol = await loop.create_datagram_endpoint(
            lambda: _Datagrams(self), remote_addr=(host, port)
        )
        protocol.join(None)
        self._closers.append(transport.close)

    def request(self, action: Callable[[Autopilot], None]) -> None:
        """Has something done to the autopilot between two steps."""
        self._requests.append(action)

    async def run(self) -> None:
        """Runs until it is cancelled; then closes every socket."""
        loop = asyncio.get_running_loop()
        last = loop.time()
        try:
            while True:
                await asyncio.sleep(TICK)
                now = loop.time()
                elapsed, last = min(now - last, SLOWEST), now
                self._admit()
                self._listen()
                self._speak()  # answers leave at once, whatever is then to be computed
                if isinstance(loop, VirtualTimeLoop):
                    self.autopilot.advance(elapsed * self.speedup)  # its clock waits meanwhile
                else:
                    # A thread: generating a flight takes a second, and the sockets must not wait.
                    await asyncio.to_thread(self.autopilot.advance, elapsed * self.speedup)
                self._speak()
        finally:
            for close in self._closers:
                close()
            await asyncio.gather(*self._handlers, return_exceptions=True)

    def _speak(self) -> None:
        """Sends what is in the outboxes."""
        for client in self._clients:
            for frame in client.frames():
                self._carry(partial(client.send, frame))

    def _listen(self) -> None:
        """Takes what has come in, and what else is asked for."""
        while self._requests:
            self._requests.popleft()(self.autopilot)
        for client in self._clients:
            while client.inbox:
                self._route(client, client.inbox.popleft())
        if self.driver is not None:
            self.driver.step(self.autopilot)

    def _route(self, client: _Client, message: Message) -> None:
        """As ArduPilot does: what is for all, or for another component, goes on to the others."""
        own = int(self.autopilot.parameters["MAV_SYSID"])
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        if system in {0, own} and component in {0, 1}:
            self.autopilot.receive(client.link, message)
        if system != own or component != 1:
            frame = bytes(message.get_msgbuf())
            for other in self._clients:
                if other is not client:
                    other.forwarded.append(frame)

    def _admit(self) -> None:
        """Clients come and go only between steps."""
        for client in self._joining:
            self.autopilot.connect(client.link)
            self._clients.append(client)
        for client in self._leaving:
            if client in self._clients:
                self._clients.remove(client)
                self.autopilot.links.disconnect(client.link)
        self._joining.clear()
        self._leaving.clear()

    def join(self, send: Callable[[bytes], None]) -> _Client:
        """A client that is reached with ``send``."""
        client = _Client(Link(), send, int(self.autopilot.parameters["MAV_SYSID"]))
        self._joining.append(client)
        return client

    def leave(self, client: _Client) -> None:
        """The client has gone."""
        self._leaving.append(client)

    def arrived(self, client: _Client, data: bytes) -> None:
        """Bytes from a client; a datagram is one frame as far as a bad link is concerned."""
        self._carry(lambda: client.feed(data))

    def _carry(self, deliver: Callable[[], None]) -> None:
        if self.impairment.harmless:
            deliver()
            return
        loop = asyncio.get_running_loop()
        for delay in self.impairment.fates():
            if delay > 0.0:
                loop.call_later(delay, deliver)
            else:
                deliver()

    async def _serve_tcp(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def send(frame: bytes) -> None:
            if not writer.is_closing():
                writer.write(frame)

        client = self.join(send)
        self._closers.append(writer.close)
        if task := asyncio.current_task():
            self._handlers.add(task)
            task.add_done_callback(self._handlers.discard)
        try:
            while data := await reader.read(4096):
                # A stream loses nothing: TCP clients are spared the impairment on their way in.
                client.feed(data)
        except ConnectionError:
            pass
        finally:
            self.leave(client)
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()


class _Datagrams(asyncio.DatagramProtocol):
    """UDP in both roles: peers by address, or the one that it is connected to."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._clients: dict[object, _Client] = {}
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keeps the transport."""
        # The event loop's own class is not a subclass of asyncio.DatagramTransport.
        self._transport = cast("asyncio.DatagramTransport", transport)

    def join(self, address: tuple[str, int] | None) -> _Client:
        """The client at an address; None is the peer that the socket is connected to."""

        def send(frame: bytes) -> None:
            if self._transport is not None and not self._transport.is_closing():
                self._transport.sendto(frame, address)

        client = self._clients[address] = self._server.join(send)
        return client

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Someone speaks; a new address is a new client."""
        known = self._clients.get(None) or self._clients.get(addr) or self.join(addr)
        self._server.arrived(known, data)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens yet: a telemetry radio keeps sending."""
        del exc
