"""The control API: JSON over HTTP, one server inside the daemon's loop.

========  ==================  ================================================================
method    path                does
========  ==================  ================================================================
GET       /api/snapshot       the snapshot (onboard.daemon.view.snapshot)
GET       /api/live           WebSocket: a snapshot at once, then one per tick
POST      /api/approve        ``{"imus": [1, 2]}``; no list: every accelerometer that waits.
                              ``"despite_diagnosis": true`` those, too, that are named and that
                              the diagnosis holds back
POST      /api/reject         ``{"imus": [1, 2]}``; no list: all
POST      /api/rollback       the same
POST      /api/reset          the same: forgets the sums
========  ==================  ================================================================

Errors are ``{"error": {"status": 400, "message": "...", "field": "imu"}}``.  Whatever changes state
wants ``Content-Type: application/json`` and, where a token is configured,
``Authorization: Bearer TOKEN``.  Requests that another site's page makes a browser send are
refused by their Origin, and so are names that merely resolve to this machine.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import logging
import re
import socket
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from typing import Annotated
from urllib.parse import urlsplit

import msgspec
from aiohttp import WSCloseCode, WSMsgType, web
from msgspec import Meta

from onboard.daemon.outlets import limits
from onboard.daemon.outlets.acceptor import Acceptor
from onboard.daemon.view.actions import Actions
from onboard.errors import OnboardError, RefusedError

logger = logging.getLogger(__name__)
library = logging.getLogger("onboard.daemon.outlets.library")
library.setLevel(logging.CRITICAL)
"""The library's own log has a traceback for every request that is none; faults of ours are told by
:func:`_errors_as_json`."""


Page = Callable[[web.Application], None]
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


_HOST = re.compile(r"(?:\[(?P<six>[0-9a-fA-F:.]+)\]|(?P<name>[^\[\]:]*))(?::\d*)?")


class Request(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Body of every POST."""

    imus: tuple[Annotated[int, Meta(ge=1, le=5)], ...] = ()


class Approval(Request, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Body of an approval; ``despite_diagnosis``: although physics is missing."""

    despite_diagnosis: bool = False


class Live:
    """The latest snapshot, for any number of viewers: a slow one skips, none is waited for."""

    def __init__(self) -> None:
        self.viewers = 0
        self._latest: bytes | None = b""
        self._version = 0
        self._changed = asyncio.Event()

    def publish(self, document: bytes | None) -> None:
        """Replace the latest snapshot and wake the viewers; None: there will be no more."""
        self._latest = document
        self._version += 1
        self._changed.set()
        self._changed = asyncio.Event()

    async def follow(self) -> AsyncIterator[bytes]:
        """Every snapshot from the next one on that the viewer is quick enough for."""
        seen = self._version
        while self._latest is not None:
            if seen == self._version:
                await self._changed.wait()
                continue
            seen = self._version
            yield self._latest


class ControlServer:
    """HTTP server; ``pages`` add further handlers, ``counters`` get what happens to connections."""

    def __init__(
        self,
        actions: Actions,
        *,
        token: str | None = None,
        pages: Iterable[Page] = (),
        counters: Counter[str] | None = None,
    ) -> None:
        self._counters: Counter[str] = Counter() if counters is None else counters
        self._actions = actions
        self._token = token
        self._runner: web.AppRunner | None = None
        self._acceptor: Acceptor | None = None
        self.live = Live()
        self.application = web.Application(
            middlewares=[_errors_as_json, self._guard], client_max_size=limits.BODY_MAX
        )
        self.application.router.add_get("/api/snapshot", self._snapshot)
        self.application.router.add_get("/api/live", self._live)
        self.application.router.add_post("/api/approve", _approving(actions))
        for name, action in (
            ("reject", actions.reject),
            ("rollback", actions.rollback),
            ("reset", actions.reset),
        ):
            self.application.router.add_post(f"/api/{name}", _acting(action))
        for page in pages:
            page(self.application)

    async def start(self, listening: socket.socket) -> None:
        """Serve on a socket that listens already; closing it is its owner's."""
        runner = web.AppRunner(
            self.application,
            access_log=None,
            logger=library,
            keepalive_timeout=limits.KEEP_ALIVE_S,
            shutdown_timeout=limits.SHUTDOWN_S,
        )
        await runner.setup()
        if runner.server is None:
            raise RuntimeError("the HTTP library has made no server")
        self._runner = runner
        self._acceptor = Acceptor(listening, runner.server, self._counters)
        self._acceptor.start()

    async def stop(self) -> None:
        """Close all connections and the port."""
        if self._acceptor is not None:
            self._acceptor.close()
            self._acceptor = None
        if self._runner is not None:
            self.live.publish(None)
            await self._runner.cleanup()
            self._runner = None

    def publish(self) -> None:
        """Send a new snapshot to the viewers, if there are any."""
        if self.live.viewers:
            self.live.publish(self._actions.snapshot().to_json())

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse foreign pages, foreign host names and, for changes, a wrong token."""
        if self._acceptor is not None:
            self._acceptor.asked(request.transport)
        if not all(_is_text(value) for _, value in request.raw_headers):
            raise web.HTTPBadRequest(text="a header is not UTF-8")
        origin = request.headers.get("Origin")
        if origin is not None and _place(origin) != request.host:
            raise web.HTTPForbidden(text=f"requests from {origin} are not accepted")
        if self._token is None and not _names_loopback(request.host):
            raise web.HTTPForbidden(text=f"host {request.host} is not this machine's loopback")
        if request.method not in {"GET", "HEAD"}:
            if self._token is not None and not _token_matches(request, self._token):
                raise web.HTTPUnauthorized(
                    text="token missing or wrong", headers={"WWW-Authenticate": "Bearer"}
                )
            if request.content_type != "application/json":
                raise web.HTTPUnsupportedMediaType(text="Content-Type must be application/json")
        return await handler(request)

    async def _snapshot(self, _request: web.Request) -> web.Response:
        return web.Response(
            body=self._actions.snapshot().to_json(),
            content_type="application/json",
            headers={"Cache-Control": "no-store"},
        )

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        if self.live.viewers >= limits.VIEWERS_MAX:
            raise web.HTTPServiceUnavailable(text=f"{limits.VIEWERS_MAX} viewers already")
        viewer = web.WebSocketResponse(heartbeat=20.0, max_msg_size=1024)
        try:
            await viewer.prepare(request)
        except ValueError:
            raise web.HTTPBadRequest(text="not a WebSocket's handshake") from None
        if self._acceptor is not None:
            self._acceptor.asked(request.transport, stays=True)
        self.live.viewers += 1
        sender = asyncio.create_task(self._feed(viewer, request.transport), name="live viewer")
        try:
            async for message in viewer:  # only to notice that the viewer has gone
                if message.type == WSMsgType.ERROR:
                    break
        finally:
            self.live.viewers -= 1
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)
        return viewer

    async def _feed(
        self, viewer: web.WebSocketResponse, transport: asyncio.Transport | None
    ) -> None:
        try:
            await _send(viewer, self._actions.snapshot().to_json())
            async for document in self.live.follow():
                await _send(viewer, document)
            await viewer.close(code=WSCloseCode.GOING_AWAY, message=b"service stops")
        except (TimeoutError, ConnectionError):
            # Who takes nothing does not take a farewell either: it would wait behind all the rest.
            if transport is not None:
                transport.abort()


async def _send(viewer: web.WebSocketResponse, document: bytes) -> None:
    async with asyncio.timeout(limits.SEND_LIMIT_S):
        await viewer.send_str(document.decode())


async def _body(request: web.Request) -> bytes:
    """The body; an empty one is an empty document."""
    try:
        async with asyncio.timeout(limits.BODY_S):
            return await request.read() or b"{}"
    except TimeoutError:
        raise web.HTTPRequestTimeout(text="the body did not come") from None


def _acting(action: Callable[[tuple[int, ...]], Awaitable[str]]) -> Handler:
    """A POST handler around one action."""

    async def handle(request: web.Request) -> web.Response:
        wanted = msgspec.json.decode(await _body(request), type=Request)
        return _json(200, {"done": await action(wanted.imus)})

    return handle


def _approving(actions: Actions) -> Handler:
    """The POST handler of approvals."""

    async def handle(request: web.Request) -> web.Response:
        wanted = msgspec.json.decode(await _body(request), type=Approval)
        done = await actions.approve(wanted.imus, despite_diagnosis=wanted.despite_diagnosis)
        return _json(200, {"done": done})

    return handle


@web.middleware
async def _errors_as_json(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Every failure leaves as one JSON object with a sentence in it."""
    try:
        return await handler(request)
    except web.HTTPException as error:
        headers = {
            name: value
            for name, value in error.headers.items()
            if name in {"Allow", "WWW-Authenticate"}
        }
        return _error(error.status, error.text or error.reason, headers=headers)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        unknown = re.search(r"unknown field `([^`]*)`", str(error))
        place = re.search(r"`\$\.?([^`]*)`", str(error))
        field = unknown or place
        return _error(400, str(error), field=field.group(1) if field else None)
    except RefusedError as error:
        return _error(409, str(error))
    except OnboardError as error:
        return _error(500, str(error))
    except ConnectionError:
        raise  # whoever asked has gone before the answer: the library lets it rest
    except Exception:
        logger.exception("request %s %s failed", request.method, request.path)
        return _error(500, "internal error; the service's log has it")


def _error(
    status: int, message: str, *, field: str | None = None, headers: dict[str, str] | None = None
) -> web.Response:
    detail: dict[str, object] = {"status": status, "message": message}
    if field is not None:
        detail["field"] = field
    return _json(status, {"error": detail}, headers=headers)


def _json(
    status: int, document: dict[str, object], *, headers: dict[str, str] | None = None
) -> web.Response:
    return web.Response(
        status=status,
        body=msgspec.json.encode(document),
        content_type="application/json",
        headers={"Cache-Control": "no-store"} | (headers or {}),
    )


def _token_matches(request: web.Request, token: str) -> bool:
    scheme, _, given = request.headers.get("Authorization", "").partition(" ")
    return scheme.lower() == "bearer" and hmac.compare_digest(given.encode(), token.encode())


def _place(origin: str) -> str | None:
    """Host and port of an origin; None if it is none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:  # a bracket that is not closed
        return None


def _is_text(header: bytes) -> bool:
    try:
        header.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _names_loopback(host: str) -> bool:
    """Whether a Host header names this machine itself (a rebound name does not)."""
    found = _HOST.fullmatch(host)
    if found is None:
        return False
    name = found["name"] or found["six"] or ""
    if name.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False
