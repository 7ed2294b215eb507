"""The daemon's HTTP server with the page, on a thread of its own, in front of a told story."""

import asyncio
import threading

import msgspec

from onboard.daemon.outlets.control import ControlServer
from onboard.daemon.outlets.door import bound
from onboard.daemon.view.history import History
from onboard.errors import RefusedError
from onboard.web.page import status_page
from tests.web.story import story


class Told:
    """Actions of a service whose snapshot the test sets; what was asked is written down."""

    def __init__(self):
        self.now = story(0)
        self.asked = []
        self.refusal = None

    def snapshot(self):
        return self.now

    async def _ask(self, what, imus):
        if self.refusal is not None:
            raise RefusedError(self.refusal)
        self.asked.append((what, imus))
        return f"{what} taken"

    async def approve(self, imus, *, despite_diagnosis=False):
        return await self._ask("approve", imus)

    async def reject(self, imus):
        return await self._ask("reject", imus)

    async def rollback(self, imus):
        return await self._ask("rollback", imus)

    async def reset(self, imus):
        return await self._ask("reset", imus)


class PageServer:
    """``with PageServer() as served``; it can be stopped and started again on the same port."""

    def __init__(self, folder, *, token=None):
        self.told = Told()
        self.folder = folder
        self.history = None
        self._token = token
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="page server")
        self._port = 0
        self._server = None
        self._socket = None

    def __enter__(self):
        self._thread.start()
        self.start()
        return self

    def __exit__(self, *_):
        self.stop()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    @property
    def url(self):
        return f"http://127.0.0.1:{self._port}/"

    def start(self):
        self._socket = bound("127.0.0.1", self._port)
        self._port = self._socket.getsockname()[1]
        self._on_loop(self._start())

    async def _start(self):
        self.history = History(self.folder, clock=self._loop.time)
        self.history.take(self.told.now)
        pages = (status_page, self.history.page)
        self._server = ControlServer(self.told, token=self._token, pages=pages)
        await self._server.start(self._socket)

    def stop(self):
        if self._server is not None:
            self.history.save()
            self._on_loop(self._server.stop())
            self._socket.close()
            self._server = None

    def tell(self, snapshot=None, /, **changes):
        """Publish a snapshot, or the last one with changes."""
        before = self.told.now if snapshot is None else snapshot
        self.told.now = msgspec.structs.replace(before, **changes)
        self._on_loop(self._publish())

    async def _publish(self):
        self.history.take(self.told.now)
        self._server.publish()

    def viewers(self):
        return self._server.live.viewers

    def _on_loop(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(60.0)
