"""Real descriptors over loopback and pseudo-terminals."""

from __future__ import annotations

import asyncio
import os
import pty
import socket
from typing import Self

import pytest

from onboard.errors import UnavailableError
from onboard.mavlink.endpoint import Endpoint, EndpointError
from onboard.mavlink.limits import WRITE_LIMIT
from onboard.mavlink.transport import open_transport

LIMIT = 20.0


class Inbox:
    """What a transport delivered, to be waited for."""

    def __init__(self) -> None:
        self.data = b""
        self.calls = 0
        self.senders = []
        self.reason: str | None = None
        self._news = asyncio.Event()

    def receive(self, data: bytes, address=None) -> None:
        self.data += data
        self.senders.append(address)
        self.calls += 1
        self._news.set()

    def lost(self, reason: str) -> None:
        assert self.reason is None, "lost twice"
        self.reason = reason
        self._news.set()

    async def until(self, condition) -> None:
        async with asyncio.timeout(LIMIT):
            while not condition(self):
                self._news.clear()
                await self._news.wait()


def udp_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", 0))
    sock.settimeout(LIMIT)
    return sock


@pytest.fixture(params=[0.0, 0.01], ids=["at once", "lingering"])
def linger(request):
    return request.param


async def test_udpin_says_who_spoke_and_answers_whom_it_is_told(linger):
    inbox = Inbox()
    transport = await open_transport(
        Endpoint.parse("udpin:127.0.0.1:0"), inbox.receive, inbox.lost, linger=linger
    )
    transport.write(b"nobody there")
    assert transport.dropped == 1
    peers = [udp_socket(), udp_socket()]
    for peer in peers:
        peer.sendto(b"hello", ("127.0.0.1", transport.port))
    await inbox.until(lambda i: len(i.data) == 10)
    addresses = [peer.getsockname() for peer in peers]
    assert inbox.senders == addresses
    transport.write(b"answer", addresses)
    transport.write(b"for you", addresses[1:])
    assert [peer.recv(100) for peer in peers] == [b"answer"] * 2
    assert peers[1].recv(100) == b"for you"
    peers[0].settimeout(0.0)
    with pytest.raises(BlockingIOError):
        peers[0].recv(100)
    for peer in peers:
        peer.close()
    transport.close()


async def test_udpout_speaks_first_and_survives_a_deaf_peer(linger):
    peer = udp_socket()
    port = peer.getsockname()[1]
    peer.close()
    inbox = Inbox()
    transport = await open_transport(
        Endpoint.parse(f"udpout:127.0.0.1:{port}"), inbox.receive, inbox.lost, linger=linger
    )
    for _ in range(5):  # refused by ICMP
        transport.write(b"anybody?")
        await asyncio.sleep(0.01)
    peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    peer.bind(("127.0.0.1", port))
    peer.settimeout(LIMIT)
    transport.write(b"anybody?")
    data, address = peer.recvfrom(100)
    if data != b"anybody?":
        pytest.fail("something else came")
    peer.sendto(b"me", address)
    await inbox.until(lambda i: i.data == b"me")
    assert inbox.reason is None
    transport.close()
    peer.close()


async def test_a_burst_of_datagrams_arrives_whole_in_few_calls():
    inbox = Inbox()
    transport = await open_transport(
        Endpoint.parse("udpin:127.0.0.1:0"), inbox.receive, inbox.lost, linger=0.05
    )
    peer = udp_socket()
    for i in range(100):
        peer.sendto(bytes((i,)) * 50, ("127.0.0.1", transport.port))
    await inbox.until(lambda i: len(i.data) == 5000)
    assert inbox.data == b"".join(bytes((i,)) * 50 for i in range(100))
    assert inbox.calls <= 10
    transport.close()
    peer.close()


async def test_what_waits_is_read_when_somebody_wants_it_or_sooner_from_then_on():
    """A wake-up for many packets, and none is left lying when an answer is waited for."""
    for hurry in (lambda t: t.read(), lambda t: t.pace(0.0)):
        inbox = Inbox()
        transport = await open_transport(
            Endpoint.parse("udpin:127.0.0.1:0"), inbox.receive, inbox.lost, linger=3600.0
        )
        peer = udp_socket()
        to = ("127.0.0.1", transport.port)
        peer.sendto(b"first", to)
        await inbox.until(lambda i: i.data == b"first")
        for _ in range(2):
            peer.sendto(b"+", to)
            await asyncio.sleep(0.05)
        assert inbox.data == b"first"  # an hour is not over
        hurry(transport)
        await inbox.until(lambda i: i.data == b"first++")
        peer.sendto(b"too late", to)
        transport.close()
        hurry(transport)  # whose descriptor may be somebody else's by now
        await asyncio.sleep(0.05)
        assert inbox.data == b"first++"
        peer.close()


async def test_a_line_that_broke_is_not_read_again(tmp_path):
    """Its descriptor may be somebody else's by then."""
    inbox = Inbox()
    async with Server() as server:
        transport = await open_transport(
            Endpoint.parse(f"tcp:127.0.0.1:{server.port}"), inbox.receive, inbox.lost, linger=3600.0
        )
        _, writer = await server.client
        writer.write(b"first")
        await inbox.until(lambda i: i.data == b"first")
        transport.close()
        other = (tmp_path / "other").open("wb+")  # takes the number that has become free
        other.write(b"not ours")
        other.flush()
        other.seek(0)
        for hurry in (transport.read, lambda: transport.pace(0.0)):
            hurry()
            await asyncio.sleep(0.01)
        assert inbox.data == b"first"
        assert other.read() == b"not ours"
        other.close()


async def test_a_port_in_use_is_named():
    taken = udp_socket()
    endpoint = Endpoint.parse(f"udpin:127.0.0.1:{taken.getsockname()[1]}")
    inbox = Inbox()
    with pytest.raises(UnavailableError, match=f"^{endpoint}: port in use$"):
        await open_transport(endpoint, inbox.receive, inbox.lost)
    taken.close()


async def test_an_address_that_is_not_ours_is_named():
    inbox = Inbox()
    with pytest.raises(UnavailableError, match=r"udpin:192\.0\.2\.1:14550: "):
        await open_transport(Endpoint.parse("udpin:192.0.2.1:14550"), inbox.receive, inbox.lost)


class Server:
    """A TCP peer with one client."""

    async def __aenter__(self) -> Self:
        self.client: asyncio.Future[tuple[asyncio.StreamReader, asyncio.StreamWriter]]
        self.client = asyncio.get_running_loop().create_future()
        self._server = await asyncio.start_server(
            lambda reader, writer: self.client.set_result((reader, writer)), "127.0.0.1", 0
        )
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_) -> None:
        if self.client.done():
            _, writer = self.client.result()
            writer.transport.abort()
        self._server.close()
        await self._server.wait_closed()


async def test_tcp_carries_bytes_both_ways_and_reports_the_end(linger):
    inbox = Inbox()
    async with Server() as server:
        transport = await open_transport(
            Endpoint.parse(f"tcp:127.0.0.1:{server.port}"), inbox.receive, inbox.lost, linger=linger
        )
        reader, writer = await server.client
        transport.write(b"to the autopilot")
        assert await reader.readexactly(16) == b"to the autopilot"
        writer.write(b"to us")
        await inbox.until(lambda i: i.data == b"to us")
        writer.close()
        await inbox.until(lambda i: i.reason is not None)
        assert inbox.reason == "closed by the other side"
        transport.write(b"too late")
        assert transport.dropped == 1
        transport.close()


async def test_tcp_refused_can_be_tried_again():
    sock = socket.socket()
    sock.bind(("127.0.0.1", 0))
    port = sock.getsockname()[1]
    sock.close()
    inbox = Inbox()
    with pytest.raises(ConnectionRefusedError):
        await open_transport(Endpoint.parse(f"tcp:127.0.0.1:{port}"), inbox.receive, inbox.lost)


async def test_a_stalled_peer_costs_a_bounded_buffer_and_then_gets_the_rest(linger):
    inbox = Inbox()
    async with Server() as server:
        transport = await open_transport(
            Endpoint.parse(f"tcp:127.0.0.1:{server.port}"), inbox.receive, inbox.lost, linger=linger
        )
        reader, _ = await server.client
        block = bytes(1000)
        sent = 0
        while transport.dropped == 0:
            transport.write(block)
            sent += 1
            assert sent < 100_000
        assert WRITE_LIMIT >= 1000
        async with asyncio.timeout(LIMIT):
            assert len(await reader.readexactly((sent - 1) * 1000)) == (sent - 1) * 1000
        transport.close()


async def test_serial_passes_every_byte_value_both_ways(linger):
    master, slave = pty.openpty()
    inbox = Inbox()
    transport = await open_transport(
        Endpoint.parse(f"serial:{os.ttyname(slave)}:115200"),
        inbox.receive,
        inbox.lost,
        linger=linger,
    )
    os.close(slave)
    every = bytes(range(256))
    os.write(master, every)
    await inbox.until(lambda i: len(i.data) >= 256)
    assert inbox.data == every
    transport.write(every)
    back = b""
    while len(back) < 256:
        back += os.read(master, 256)
    assert back == every
    os.close(master)  # unplugged
    await inbox.until(lambda i: i.reason is not None)
    transport.close()


async def test_serial_ports_are_held_alone():
    master, slave = pty.openpty()
    endpoint = Endpoint.parse(f"serial:{os.ttyname(slave)}:57600")
    inbox = Inbox()
    transport = await open_transport(endpoint, inbox.receive, inbox.lost)
    with pytest.raises(UnavailableError, match="port in use by another program"):
        await open_transport(endpoint, inbox.receive, inbox.lost)
    transport.close()
    again = await open_transport(endpoint, inbox.receive, inbox.lost)
    again.close()
    os.close(master)
    os.close(slave)


async def test_a_file_is_not_a_serial_port(tmp_path):
    path = tmp_path / "file"
    path.touch()
    inbox = Inbox()
    with pytest.raises(EndpointError, match="not a serial device"):
        await open_transport(Endpoint.parse(f"serial:{path}:57600"), inbox.receive, inbox.lost)


async def test_a_device_that_is_not_there_can_be_tried_again(tmp_path):
    inbox = Inbox()
    with pytest.raises(FileNotFoundError):
        await open_transport(
            Endpoint.parse(f"serial:{tmp_path}/ttyACM0:57600"), inbox.receive, inbox.lost
        )


async def test_closing_twice_is_harmless():
    inbox = Inbox()
    transport = await open_transport(Endpoint.parse("udpin:127.0.0.1:0"), inbox.receive, inbox.lost)
    transport.close()
    transport.close()
    transport.write(b"gone")
    assert transport.dropped == 1


async def test_a_closed_transport_is_not_read_any_more(linger):
    """Or the next socket with its number would wake whoever read the old one."""
    inbox = Inbox()
    transport = await open_transport(
        Endpoint.parse("udpin:127.0.0.1:0"), inbox.receive, inbox.lost, linger=linger
    )
    descriptor = transport._socket.fileno()
    with udp_socket() as peer:
        peer.sendto(b"hello", ("127.0.0.1", transport.port))
        await inbox.until(lambda i: len(i.data) == 5)
        peer.sendto(b"again", ("127.0.0.1", transport.port))
        transport.close()
        assert not asyncio.get_running_loop().remove_reader(descriptor)
        await asyncio.sleep(3.0 * linger)
    assert bytes(inbox.data) == b"hello"
