"""A real mosquitto on loopback, which a test may stop, start again and look into."""

import asyncio
import contextlib
import os
import shutil
import signal
import socket

import aiomqtt
import pytest

EXECUTABLE = shutil.which("mosquitto", path="/usr/local/sbin:/usr/sbin:/usr/local/bin:/usr/bin")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Broker:
    """``lines`` are added to a configuration that listens on ``port`` and keeps nothing on disk."""

    def __init__(self, directory, *lines, credentials=None):
        if EXECUTABLE is None:
            pytest.skip("mosquitto is not installed (Debian: apt-get install mosquitto)")
        self.port = free_port()
        self.credentials = credentials or {}
        self._file = directory / "mosquitto.conf"
        self._log = directory / "mosquitto.log"
        forgets = () if "persistence true" in lines else ("persistence false",)
        who = () if lines else ("allow_anonymous true",)
        if os.getuid() == 0:
            who = ("user root", *who)  # else it changes its user and cannot read a test's files
        self._file.write_text(
            "\n".join((f"listener {self.port} 127.0.0.1", *forgets, *who, *lines, ""))
        )
        self._process = None

    async def __aenter__(self):
        await self.start()
        return self

    async def __aexit__(self, *_):
        await self.stop()

    async def start(self):
        with self._log.open("ab") as log:
            self._process = await asyncio.create_subprocess_exec(
                EXECUTABLE, "-v", "-c", str(self._file), stdout=log, stderr=log
            )
        async with asyncio.timeout(30.0):
            while True:
                assert self._process.returncode is None, self._log.read_text()
                with contextlib.suppress(OSError):
                    _, writer = await asyncio.open_connection("127.0.0.1", self.port)
                    writer.close()
                    await writer.wait_closed()
                    return
                await asyncio.sleep(0.02)

    async def stop(self, *, orderly=False):
        """As when power goes: without a farewell, and it forgets everything; or as it is told."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate() if orderly else self._process.kill()
            await self._process.wait()
            self._process = None

    def freeze(self):
        """It holds its connections and answers nothing, as when its disk or machine hangs."""
        self._process.send_signal(signal.SIGSTOP)

    def thaw(self):
        self._process.send_signal(signal.SIGCONT)

    @property
    def log(self):
        return self._log.read_text()

    def client(self, **options):
        return aiomqtt.Client("127.0.0.1", self.port, **(self.credentials | options))


class Subscriber:
    """Somebody who hears everything; what came is in ``messages``, the last one in ``latest``."""

    def __init__(self, client, topic="#"):
        self.client = client
        self.messages = []
        self.latest = {}
        self._topic = topic
        self._task = None
        self._news = asyncio.Event()

    async def __aenter__(self):
        await self.client.__aenter__()
        await self.client.subscribe(self._topic, qos=1)
        self._task = asyncio.create_task(self._hear(), name="subscriber")
        return self

    async def __aexit__(self, *_):
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        with contextlib.suppress(aiomqtt.MqttError):
            await self.client.__aexit__(None, None, None)

    async def _hear(self):
        with contextlib.suppress(aiomqtt.MqttError):
            async for message in self.client.messages:
                self.messages.append(message)
                self.latest[str(message.topic)] = message.payload
                self._news.set()

    async def until(self, condition):
        async with asyncio.timeout(60.0):
            while not condition():
                self._news.clear()
                await self._news.wait()

    async def payload(self, topic):
        await self.until(lambda: topic in self.latest)
        return self.latest[topic]

    def all(self, topic):
        return [m.payload for m in self.messages if str(m.topic) == topic]
