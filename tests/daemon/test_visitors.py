"""HTTP visitors that say nothing, or nonsense: others are served, and files are written."""

from __future__ import annotations

import asyncio
import errno
import resource
import socket
import tracemalloc
import zlib
from collections import Counter
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import aiohttp
import pytest

from onboard.daemon.outlets import limits
from onboard.daemon.outlets.acceptor import Acceptor
from onboard.daemon.outlets.control import ControlServer
from onboard.daemon.outlets.door import bound
from tests.daemon.daemons import until
from tests.daemon.test_control import Recorded


@asynccontextmanager
async def serving(**options):
    counters = Counter()
    server = ControlServer(Recorded(), counters=counters, **options)
    with bound("127.0.0.1", 0) as listening:
        await server.start(listening)
        try:
            yield listening.getsockname(), counters, server
        finally:
            await server.stop()


async def ask(address, path="/api/snapshot"):
    url = f"http://127.0.0.1:{address[1]}"
    async with aiohttp.ClientSession(url) as client, client.get(path) as response:
        await response.read()
        return response.status


async def said(address, text):
    """What is answered to raw text, until the connection is closed or rests."""
    reader, writer = await asyncio.open_connection(*address)
    writer.write(text)
    try:
        async with asyncio.timeout(20.0):
            return await reader.readuntil(b"\r\n\r\n")
    finally:
        writer.close()


def descriptors():
    """How many are in use, or about so many where the system does not tell."""
    used = Path("/proc/self/fd")
    return len(list(used.iterdir())) if used.is_dir() else 40


async def silent(address, count):
    return [await asyncio.open_connection(*address) for _ in range(count)]


def close(connections):
    for _, writer in connections:
        writer.close()


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(limits, "CONNECTIONS_MAX", 4)


async def test_the_silent_make_room_for_those_who_ask(few):
    async with serving() as (address, counters, _):
        idle = await silent(address, 20)
        assert await ask(address) == 200
        assert counters["http_disconnected"] >= 16
        close(idle)


async def test_who_asks_keeps_the_place_until_it_has_been_there_for_long(few, monkeypatch):
    async with (
        serving() as (address, counters, _),
        aiohttp.ClientSession(f"http://127.0.0.1:{address[1]}") as client,
    ):
        sockets = [await client.ws_connect("/api/live") for _ in range(4)]
        with pytest.raises(aiohttp.ClientError):
            await ask(address)
        assert counters["http_refused"] >= 1
        monkeypatch.setattr(limits, "VISIT_S", 0.0)
        await asyncio.sleep(1.2)
        assert not any(ws.closed for ws in sockets)  # viewers stay
        assert counters["http_disconnected"] == 0
        for ws in sockets:
            await ws.close()


@pytest.mark.parametrize("start", [b"", b"GET / HT", b"GET / HTTP/1.1\r\nHost: x\r\nX: "])
async def test_who_asks_for_nothing_in_time_is_disconnected(monkeypatch, start):
    monkeypatch.setattr(limits, "FIRST_REQUEST_S", 0.1)
    async with serving() as (address, counters, _):
        reader, writer = await asyncio.open_connection(*address)
        writer.write(start)
        async with asyncio.timeout(20.0):
            with suppress(ConnectionError):
                assert await reader.read() == b""
        assert counters["http_disconnected"] == 1
        writer.close()


async def test_a_body_that_does_not_come_is_told(monkeypatch):
    monkeypatch.setattr(limits, "BODY_S", 0.05)
    async with serving() as (address, _, _):
        head = b"POST /api/reject HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        answer = await said(address, head + b"Content-Length: 9\r\n\r\n{")
        assert b" 408 " in answer.splitlines()[0]


async def test_without_descriptors_it_waits_and_says_so_once(caplog, monkeypatch):
    """No line in the log for each try, and no try for each turn of the loop."""
    tries = 0

    class Exhausted(socket.socket):
        def accept(self):
            nonlocal tries
            tries += 1
            raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(limits, "ACCEPT_RETRY_S", 0.02)
    listening = Exhausted(socket.AF_INET, socket.SOCK_STREAM)
    with listening:
        listening.settimeout(0.0)
        listening.bind(("127.0.0.1", 0))
        listening.listen(8)
        acceptor = Acceptor(listening, asyncio.Protocol, Counter())
        acceptor.start()
        idle = await silent(listening.getsockname(), 3)
        await until(lambda: tries >= 3)
        turns = 0
        before = tries
        while tries < before + 2:
            turns += 1
            await asyncio.sleep(0)
        assert turns > 10  # others had theirs
        acceptor.close()
        close(idle)
    assert acceptor.counters["http_accept_failed"] == tries
    assert len(caplog.records) == 1


async def test_descriptors_are_left_for_files(tmp_path):
    """90 idle visitors where 64 descriptors are allowed: a file can still be written."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    async with serving() as (address, _, _):
        used = descriptors()
        script = (
            "import socket,sys,time\n"
            f"s=[socket.create_connection(('127.0.0.1',{address[1]})) for _ in range(90)]\n"
            "print('there',flush=True); sys.stdin.read()\n"
        )
        resource.setrlimit(resource.RLIMIT_NOFILE, (used + 40, before[1]))
        try:
            crowd = await asyncio.create_subprocess_exec(
                "python3", "-c", script,
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, before),
            )  # fmt: skip
            assert crowd.stdout is not None
            await crowd.stdout.readline()
            (tmp_path / "sums").write_bytes(b"saved")
            assert await ask(address) == 200
            crowd.stdin.close()
            await crowd.wait()
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)


@pytest.mark.parametrize(
    "host", [b"[::1", b"[", b"]", b"[::1]x", b"a:b:c", b"\xff", b"", b"[v1.x]"]
)
@pytest.mark.parametrize("header", [b"Host", b"Origin"])
async def test_a_host_or_origin_that_is_none_is_refused(caplog, header, host):
    async with serving() as (address, _, _):
        head = b"GET /api/snapshot HTTP/1.1\r\nConnection: close\r\n"
        if header == b"Origin":
            head += b"Host: localhost\r\n"
        answer = await said(address, head + header + b": " + host + b"\r\n\r\n")
        assert answer.split(b" ")[1] in {b"400", b"403"}
    assert not caplog.records


@pytest.mark.parametrize("given", [b"Bearer \xff", b"Bearer", b"", b"\xff \xff", b"Basic b3Blbg=="])
async def test_any_authorization_but_the_right_one_is_401(caplog, given):
    async with serving(token="open") as (address, _, _):
        head = b"POST /api/reset HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
        head += b"Connection: close\r\nContent-Length: 2\r\nAuthorization: " + given
        answer = await said(address, head + b"\r\n\r\n{}")
        assert answer.split(b" ")[1] in {b"400", b"401"}
    assert not caplog.records


@pytest.mark.parametrize(
    "body", [b"[" * 15_000, b'{"imus": [1' + b"0" * 5000 + b"]}", b"\xff", b'{"imus": [1e999]}']
)
async def test_a_hostile_body_is_400(caplog, body):
    async with serving() as (address, _, _):
        head = b"POST /api/reset HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        head += b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
        answer = await said(address, head + body)
        assert answer.split(b" ")[1] == b"400"
    assert not caplog.records


@pytest.mark.parametrize("coding", ["gzip", "deflate"])
async def test_a_body_that_unfolds_without_end_is_not_unfolded(caplog, coding):
    wide = 31 if coding == "gzip" else zlib.MAX_WBITS
    folding = zlib.compressobj(9, zlib.DEFLATED, wide)
    body = b"".join(folding.compress(bytes(1 << 20)) for _ in range(64)) + folding.flush()
    async with serving() as (address, _, _):
        head = b"POST /api/reset HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        head += b"Content-Encoding: %s\r\n" % coding.encode()
        head += b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
        tracemalloc.start()
        try:
            answer = await said(address, head + body)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert answer.split(b" ")[1] == b"413"
    assert peak < 8 << 20  # of 64 MB that it would be
    assert not caplog.records
