"""Whoever answers in the service's place: one line and a status, and nothing called done."""

from __future__ import annotations

import contextlib
import socket
import threading

import pytest

from onboard.cli.main import run

BODIES = {
    "text": b"hello",
    "nothing": b"",
    "not a word of it": b"{}",
    "list": b"[1]",
    "nested": b"[" * 200_000,
    "deep in a field": b'{"done": ' + b"[" * 200_000,
    "no text": b"\x00\xff" * 100,
    "done, but what": b'{"done": null}',
    "another schema": b'{"schema": "onboard.state/9"}',
    "a number without end": b'{"done": ' + b"9" * 5000 + b"}",
}
VERBS = (["status"], ["status", "--json"], ["approve"], ["reject"], ["rollback"], ["reset"])


@pytest.fixture
def answering():
    """``answering(bytes)`` is the URL of somebody who says that to everybody."""
    listening = []

    def begin(answer: bytes) -> str:
        here = socket.create_server(("127.0.0.1", 0))
        listening.append(here)

        def serve() -> None:
            with contextlib.suppress(OSError):  # closed: the test is over
                while True:
                    visitor, _ = here.accept()
                    with visitor, contextlib.suppress(OSError):
                        visitor.recv(65536)
                        visitor.sendall(answer)
                        # Closed with something unread, it would take the answer back.
                        visitor.shutdown(socket.SHUT_WR)
                        while visitor.recv(65536):
                            pass

        threading.Thread(target=serve, daemon=True).start()
        return f"http://127.0.0.1:{here.getsockname()[1]}"

    yield begin
    for here in listening:
        here.shutdown(socket.SHUT_RDWR)
        here.close()


def refused(capsys) -> str:
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("onboard: ")
    return err


@pytest.mark.parametrize("verb", VERBS, ids=" ".join)
@pytest.mark.parametrize("name", BODIES)
def test_an_answer_that_is_none_of_ours_is_told(answering, capsys, verb, name):
    body = BODIES[name]
    url = answering(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
    assert run([*verb, "--url", url]) == 3
    assert "not the onboard service of this version" in refused(capsys)


@pytest.mark.parametrize("body", [b"{", b"[" * 200_000, b'{"error": 1}', b'{"error": []}'])
def test_a_refusal_that_says_nothing_is_told(answering, capsys, body):
    url = answering(b"HTTP/1.1 409 No\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
    assert run(["approve", "--url", url]) == 2
    assert "the service answered with status 409" in refused(capsys)


def test_orders_to_a_terminal_are_not_passed_on(answering, capsys):
    body = b'{"done": "written \\u001b[2J\\u202e"}'
    url = answering(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
    assert run(["approve", "--url", url]) == 0
    assert capsys.readouterr().out == "written \ufffd[2J\ufffd\n"


@pytest.mark.parametrize(
    "url",
    ["http://[::1", "ftp://x", "http://127.0.0.1:99999", "http://a b/", "http://127.0.0.1:1\nX: y"],
)
def test_an_address_that_is_none_is_one_line(capsys, url):
    assert run(["status", "--url", url]) == 2
    assert "expected http://HOST:PORT" in refused(capsys)
