"""The API's manual against the running server: paths, fields, and every error provoked."""

from __future__ import annotations

import re
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp
import msgspec
import pytest

from onboard.daemon.outlets.control import ControlServer
from onboard.daemon.outlets.door import bound
from onboard.daemon.outlets.limits import BODY_MAX, VIEWERS_MAX
from onboard.daemon.view import snapshot
from onboard.daemon.view.history import ROWS_MAX, SCHEMA, History
from onboard.daemon.view.snapshot import Record, Snapshot
from onboard.errors import RefusedError
from onboard.web.page import status_page
from tests.daemon.blank_snapshot import blank_snapshot

ROOT = Path(__file__).resolve().parents[2]

MANUAL = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
JSON = {"Content-Type": "application/json"}


class Actions:
    """A service that does whatever it is asked, or refuses, or breaks."""

    failure: Exception | None = None

    def snapshot(self) -> Snapshot:
        return blank_snapshot()

    async def _ask(self, imus: tuple[int, ...], **_more: bool) -> str:
        if self.failure is not None:
            raise self.failure
        return f"done for {imus}"

    approve = reject = rollback = reset = _ask


@asynccontextmanager
async def served(folder, *, token=None):
    actions = Actions()
    history = History(folder, clock=lambda: 0.0)
    server = ControlServer(actions, token=token, pages=(status_page, history.page))
    with bound("127.0.0.1", 0) as listening:
        await server.start(listening)
        url = f"http://127.0.0.1:{listening.getsockname()[1]}"
        try:
            async with aiohttp.ClientSession(url) as client:
                yield server, actions, client
        finally:
            await server.stop()


def section(title: str) -> str:
    found = re.search(rf"^##+ {title}\n(.*?)(?=^##|\Z)", MANUAL, re.MULTILINE | re.DOTALL)
    assert found is not None, title
    return found.group(1)


async def test_it_has_every_path_and_method_of_the_server(tmp_path):
    async with served(tmp_path) as (server, _, client):
        routes = {
            (route.method, route.resource.canonical)
            for route in server.application.router.routes()
            if route.resource is not None and route.method != "HEAD"
        }
        there = {
            (m, re.sub(r"^/static$", "/static/{filename}", path)) for m, path in routes if path
        }
        told = set(re.findall(r"^\| (GET|POST) \| `([^`]+)` \|", MANUAL, re.MULTILINE))
        assert told == there
        for method, path in told:
            if method == "POST":
                extra = {"despite_diagnosis": True} if path.endswith("approve") else {}
                async with client.post(path, json={"imus": [1], **extra}) as answer:
                    assert (answer.status, list(await answer.json())) == (200, ["done"])
            elif path == "/api/live":
                async with client.ws_connect(path) as viewer:
                    assert Snapshot.from_json((await viewer.receive_str()).encode())
            else:
                async with client.get(path.replace("{filename}", "main.js")) as answer:
                    assert answer.status == 200
        async with client.get("/api/history") as answer:
            assert await answer.json() == {"imus": [], "schema": SCHEMA}
    assert f"`{SCHEMA}`" in MANUAL or f'"{SCHEMA}"' in MANUAL
    assert f"at most {ROWS_MAX} rows" in MANUAL
    assert f"at most {VIEWERS_MAX} viewers" in MANUAL
    assert f"{BODY_MAX // 1024} KiB" in MANUAL


async def provoked(folder) -> dict[int, dict[str, object]]:
    """An error of every status that the server can be brought to."""
    found: dict[int, dict[str, object]] = {}

    async def take(response: aiohttp.ClientResponse) -> None:
        found[response.status] = (await response.json())["error"]

    async with served(folder) as (server, actions, client):
        async with client.post("/api/approve", json={"imu": [1]}) as r:
            await take(r)
        async with client.get("/api/snapshot", headers={"Origin": "http://elsewhere"}) as r:
            await take(r)
        async with client.get("/api/nothing") as r:
            await take(r)
        async with client.get("/api/approve") as r:
            await take(r)
        async with client.post("/api/approve", data=b" " * (BODY_MAX + 1), headers=JSON) as r:
            await take(r)
        async with client.post("/api/approve", data=b"{}", headers={"Content-Type": "x/y"}) as r:
            await take(r)
        actions.failure = RefusedError("nothing waits for approval")
        async with client.post("/api/approve", json={}) as r:
            await take(r)
        actions.failure = ZeroDivisionError()
        async with client.post("/api/approve", json={}) as r:
            await take(r)
        server.live.viewers = VIEWERS_MAX
        async with client.get("/api/live") as r:
            await take(r)
        server.live.viewers = 0
    async with served(folder, token="key") as (_, _, client):
        wrong = {"Authorization": "Bearer lock"}
        async with client.post("/api/approve", json={}, headers=wrong) as r:
            await take(r)
    return found


async def test_it_has_every_error_and_each_is_one_object(tmp_path):
    found = await provoked(tmp_path)
    told = {
        int(status) for status in re.findall(r"^\| (\d{3}) \|", section("Errors"), re.MULTILINE)
    }
    assert told == set(found)
    for status, error in found.items():
        assert error["status"] == status
        assert error["message"]
    assert found[400]["field"] == "imu"
    shown = msgspec.json.decode(re.findall(r"```json\n(.*?)```", section("Errors"), re.DOTALL)[0])
    assert set(shown["error"]) == set(found[400])
    assert found[400]["message"] == shown["error"]["message"]


RECORDS = [
    r
    for r in vars(snapshot).values()
    if isinstance(r, type) and issubclass(r, Record) and r is not Record
]


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.__name__)
def test_it_has_every_field_of_the_snapshot_in_order(record):
    told = re.findall(r"^\| `(\w+)` \|", section(record.__name__), re.MULTILINE)
    there = [field.name for field in msgspec.structs.fields(record)]
    assert sorted(told) == sorted(there)
