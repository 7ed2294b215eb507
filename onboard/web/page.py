"""The status page as a page of :class:`onboard.daemon.outlets.control.ControlServer`.

The files are in ``static``; all they ask for is there too, so that they work on a field without
network.  The policy below forbids the browser everything else: no script, style or connection but
the service's own, no frame around it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from onboard import __version__
from onboard.answers.words import DISTRUST
from onboard.core.physics.catalogue import kinds

if TYPE_CHECKING:
    from aiohttp import web

STATIC = Path(__file__).parent / "static"
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


BLUEOS = {
    "name": "onboard",
    "description": "In-flight calibration of the autopilot's accelerometers",
    "icon": "mdi-axis-arrow",
    "company": "onboard",
    "version": __version__,
    "new_page": True,
    "webpage": "",
    "api": "/api/snapshot",
}
"""What BlueOS asks of every port, at ``/register_service``, for the entry in its menu: in a tab
of its own, because no other page may have this one in a frame."""


def look() -> str:
    """The palette and type of everything that people see, as CSS, for embedding in a report."""
    return (STATIC / "look.css").read_text(encoding="utf-8")


def vocabulary() -> dict[str, dict[str, str]]:
    """Names of the snapshot in words: effects from the catalogue, reasons to distrust GPS."""
    return {"effects": {kind.effect: kind.title for kind in kinds()}, "reasons": dict(DISTRUST)}


def status_page(application: web.Application) -> None:
    """Serve the page at ``/`` and its files under ``/static/``.

    The HTTP library is imported here and not above: a service that nobody looks at never loads it.
    """
    from aiohttp import web  # noqa: PLC0415

    async def index(_request: web.Request) -> web.StreamResponse:
        return web.FileResponse(STATIC / "index.html")

    async def words(_request: web.Request) -> web.StreamResponse:
        return web.json_response(vocabulary())

    async def blueos(_request: web.Request) -> web.StreamResponse:
        return web.json_response(BLUEOS)

    async def complete(_request: web.Request, response: web.StreamResponse) -> None:
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        # A browser asks again each time and mostly hears 304: after an update no old script stays.
        response.headers.setdefault("Cache-Control", "no-cache")

    application.router.add_get("/", index)
    application.router.add_get("/words.json", words)
    application.router.add_get("/register_service", blueos)
    application.router.add_static("/static/", STATIC)
    application.on_response_prepare.append(complete)
