"""The control API over real sockets on loopback."""

import asyncio
import socket
from contextlib import asynccontextmanager

import aiohttp
import pytest

from onboard.daemon.outlets import limits
from onboard.daemon.outlets.control import ControlServer
from onboard.daemon.outlets.door import Door, bound
from onboard.daemon.outlets.limits import VIEWERS_MAX
from onboard.daemon.view.snapshot import Snapshot
from onboard.errors import RefusedError, UnavailableError
from tests.daemon.blank_snapshot import blank_snapshot
from tests.daemon.daemons import until

TOKEN = "open"
CHANGES = ("approve", "reject", "rollback", "reset")


class Recorded:
    """Actions that only write down what was asked."""

    def __init__(self):
        self.asked = []
        self.ticks = 0
        self.failure = None

    def snapshot(self):
        self.ticks += 1
        return blank_snapshot(uptime_s=float(self.ticks))

    async def _ask(self, what, imus):
        if self.failure is not None:
            raise self.failure
        self.asked.append((what, imus))
        return f"{what} done"

    async def approve(self, imus, *, despite_diagnosis=False):
        what = "approve despite the diagnosis" if despite_diagnosis else "approve"
        return await self._ask(what, imus)

    async def reject(self, imus):
        return await self._ask("reject", imus)

    async def rollback(self, imus):
        return await self._ask("rollback", imus)

    async def reset(self, imus):
        return await self._ask("reset", imus)


@asynccontextmanager
async def serving(*, token=None, pages=()):
    actions = Recorded()
    server = ControlServer(actions, token=token, pages=pages)
    with bound("127.0.0.1", 0) as listening:
        await server.start(listening)
        url = f"http://127.0.0.1:{listening.getsockname()[1]}"
        try:
            async with aiohttp.ClientSession(url) as client:
                yield server, actions, client
        finally:
            await server.stop()


async def error_of(response):
    return (await response.json())["error"]


async def test_the_snapshot_is_one_json_object_that_reads_back():
    async with serving() as (_, _, client), client.get("/api/snapshot") as response:
        assert response.status == 200
        assert response.content_type == "application/json"
        assert Snapshot.from_json(await response.read()) == blank_snapshot(uptime_s=1.0)


@pytest.mark.parametrize("action", CHANGES)
async def test_actions_reach_the_service_with_their_accelerometers(action):
    async with serving() as (_, actions, client):
        async with client.post(f"/api/{action}", json={"imus": [2, 1]}) as response:
            assert (response.status, await response.json()) == (200, {"done": f"{action} done"})
        async with client.post(f"/api/{action}", json={}) as response:
            assert response.status == 200
        assert actions.asked == [(action, (2, 1)), (action, ())]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ('{"imu": [1]}', "imu"),
        ('{"imus": [9]}', "imus[0]"),
        ('{"imus": "all"}', "imus"),
        ("[1]", None),
        ("{", None),
        ("\xff", None),
    ],
)
async def test_a_wrong_body_is_400_and_names_the_field(body, field):
    async with serving() as (_, actions, client):
        headers = {"Content-Type": "application/json"}
        async with client.post("/api/approve", data=body, headers=headers) as response:
            error = await error_of(response)
            assert (response.status, error["status"]) == (400, 400)
            assert error.get("field") == field
            assert error["message"]
        assert actions.asked == []


async def test_what_cannot_be_done_now_is_409_with_the_reason():
    async with serving() as (_, actions, client):
        actions.failure = RefusedError("nothing waits for approval")
        async with client.post("/api/approve", json={}) as response:
            assert response.status == 409
            assert (await error_of(response))["message"] == "nothing waits for approval"


async def test_a_failure_of_ours_is_500_json_and_keeps_its_details_to_the_log(caplog):
    async with serving() as (_, actions, client):
        actions.failure = ZeroDivisionError("secret")
        async with client.post("/api/approve", json={}) as response:
            assert response.status == 500
            assert "secret" not in await response.text()
        assert "secret" in caplog.text


async def test_an_approval_despite_the_diagnosis_has_to_say_so():
    async with serving() as (_, actions, client):
        body = {"imus": [2], "despite_diagnosis": True}
        async with client.post("/api/approve", json=body) as response:
            assert response.status == 200
        assert actions.asked == [("approve despite the diagnosis", (2,))]
        async with client.post("/api/reject", json=body) as response:
            assert response.status == 400
            assert (await error_of(response))["field"] == "despite_diagnosis"


@pytest.mark.parametrize("action", CHANGES)
@pytest.mark.parametrize("authorization", [None, "Bearer wrong", "Basic open", "Bearer"])
async def test_a_wrong_token_is_401_and_changes_nothing(action, authorization):
    headers = {} if authorization is None else {"Authorization": authorization}
    async with serving(token=TOKEN) as (_, actions, client):
        async with client.post(f"/api/{action}", json={}, headers=headers) as response:
            assert response.status == 401
            assert (await error_of(response))["status"] == 401
        assert actions.asked == []


async def test_the_right_token_acts_and_reading_needs_none():
    async with serving(token=TOKEN) as (_, actions, client):
        headers = {"Authorization": "Bearer open"}
        async with client.post("/api/approve", json={}, headers=headers) as response:
            assert response.status == 200
        async with client.get("/api/snapshot") as response:
            assert response.status == 200
        assert actions.asked == [("approve", ())]


async def test_a_foreign_page_in_the_operators_browser_can_do_nothing():
    async with serving() as (_, actions, client):
        for headers in ({"Origin": "http://evil.example"}, {"Host": "rebound.example"}):
            async with client.post("/api/approve", json={}, headers=headers) as response:
                assert response.status == 403
            with pytest.raises(aiohttp.WSServerHandshakeError):
                await client.ws_connect("/api/live", headers=headers)
        # a form needs no preflight, so it must not be understood
        async with client.post("/api/approve", data={"imus": "1"}) as response:
            assert response.status == 415
        async with client.post(
            "/api/approve", json={}, headers={"Origin": str(client._base_url).rstrip("/")}
        ) as response:
            assert response.status == 200
        assert actions.asked == [("approve", ())]


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/api/nothing", 404), ("GET", "/api/approve", 405), ("POST", "/api/snapshot", 405)],
)
async def test_other_mistakes_are_json_too(method, path, status):
    async with serving() as (_, _, client), client.request(method, path, json={}) as response:
        assert response.status == status
        assert (await error_of(response))["status"] == status


async def test_live_sends_one_at_once_then_one_per_publication_to_every_viewer():
    async with serving() as (server, _, client):
        viewers = [await client.ws_connect("/api/live") for _ in range(2)]
        first = [Snapshot.from_json((await v.receive_str()).encode()) for v in viewers]
        assert {snapshot.uptime_s for snapshot in first} == {1.0, 2.0}
        for expected in (3.0, 4.0):
            server.publish()
            for viewer in viewers:
                snapshot = Snapshot.from_json((await viewer.receive_str()).encode())
                assert snapshot.uptime_s == expected
        for viewer in viewers:
            await viewer.close()


async def test_without_viewers_no_snapshot_is_built():
    async with serving() as (server, actions, _):
        server.publish()
        assert actions.ticks == 0


async def test_viewers_are_bounded_and_leaving_makes_room():
    async with serving() as (_, _, client):
        viewers = [await client.ws_connect("/api/live") for _ in range(VIEWERS_MAX)]
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await client.ws_connect("/api/live")
        assert refused.value.status == 503
        await viewers.pop().close()
        async with asyncio.timeout(20):
            while (viewer := await _viewer(client)) is None:
                pass
        for leaving in (*viewers, viewer):
            await leaving.close()


async def test_a_viewer_that_reads_nothing_is_let_go_and_keeps_nobody_waiting(monkeypatch):
    monkeypatch.setattr(limits, "SEND_LIMIT_S", 0.3)
    document = b'"' + bytes(48 + n % 75 for n in range(300_000)).replace(b"\\", b"/") + b'"'
    async with serving() as (server, _, client):
        other = await client.ws_connect("/api/live")
        await other.receive_str()
        with socket.socket() as stalled:
            stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            stalled.connect((client._base_url.host, client._base_url.port))
            stalled.sendall(
                b"GET /api/live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
                b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
            )
            await until(lambda: server.live.viewers == 2)
            for _ in range(40):
                server.live.publish(document)
                async with asyncio.timeout(20.0):
                    assert len(await other.receive_str()) == len(document)
            await until(lambda: server.live.viewers == 1, limit=20.0)
            server.live.publish(b'"still there"')
            assert await other.receive_str() == '"still there"'
        await other.close()


async def _viewer(client):
    try:
        return await client.ws_connect("/api/live")
    except aiohttp.WSServerHandshakeError:
        return None


async def test_stopping_says_goodbye_to_viewers():
    async with serving() as (server, _, client):
        viewer = await client.ws_connect("/api/live")
        await viewer.receive_str()
        stopping = asyncio.create_task(server.stop())
        message = await viewer.receive()
        assert message.type == aiohttp.WSMsgType.CLOSE
        assert viewer.close_code == aiohttp.WSCloseCode.GOING_AWAY
        await stopping


def a_door(actions, port=0):
    return Door(actions, address="127.0.0.1", port=port, token=None)


async def test_a_taken_port_is_one_line():
    with bound("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UnavailableError, match=rf"\[http\] 127.0.0.1:{port}: .*in use"):
            a_door(Recorded(), port).listen()


async def test_the_door_opens_when_somebody_knocks_and_closes_for_good():
    actions = Recorded()
    door = a_door(actions)
    door.listen()
    url = door.url
    door.publish()
    assert actions.ticks == 0
    async with aiohttp.ClientSession(url) as client:
        async with client.get("/api/snapshot") as response:
            assert response.status == 200
        viewer = await client.ws_connect("/api/live")
        await viewer.receive_str()
        door.publish()
        await viewer.receive_str()
        closing = asyncio.create_task(door.close())
        assert (await viewer.receive()).type == aiohttp.WSMsgType.CLOSE
        await closing
        with pytest.raises(aiohttp.ClientConnectionError):
            await client.get("/api/snapshot")


async def test_a_door_that_nobody_knocked_at_closes_too():
    door = a_door(Recorded())
    door.listen()
    port = int(door.url.rsplit(":", 1)[1])
    await door.close()
    with bound("127.0.0.1", port) as free:
        assert free.getsockname()[1] == port


async def test_pages_are_added_as_handlers():
    def page(application):
        async def hello(_request):
            return aiohttp.web.Response(text="hello")

        application.router.add_get("/", hello)

    async with serving(pages=[page]) as (_, _, client), client.get("/") as response:
        assert await response.text() == "hello"
