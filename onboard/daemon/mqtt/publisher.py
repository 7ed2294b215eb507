"""The publisher: one connection to the broker, kept for as long as the service runs.

The service hands over a snapshot now and then and never waits; a broker that is absent, refuses
or hangs is told of once, and tried again with full-jitter back-off.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import random
import re
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

import aiomqtt

from onboard.daemon.mqtt import limits
from onboard.daemon.mqtt.client import Client
from onboard.daemon.mqtt.commands import Commands
from onboard.daemon.mqtt.hang_ups import HangUps
from onboard.daemon.mqtt.home_assistant import discovery_message, discovery_topic
from onboard.daemon.mqtt.outbox import Outbox, Parcel, newer
from onboard.daemon.mqtt.payloads import calibration_message, document, event_message
from onboard.daemon.mqtt.place import Place
from onboard.daemon.mqtt.summary import summary_message
from onboard.daemon.mqtt.tls import tls_context
from onboard.daemon.setup.configuration import MqttSettings
from onboard.daemon.setup.secret_files import read_secret
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import JournalLine, Snapshot
from onboard.mavlink.connection import Backoff
from onboard.outage import Outage

if TYPE_CHECKING:
    from onboard.daemon.view.actions import Actions

logger = logging.getLogger(__name__)
library = logging.getLogger("onboard.daemon.mqtt.library")
library.setLevel(logging.CRITICAL)
"""The library's own log has a line for every attempt; what matters is told as a notice."""

ONLINE, OFFLINE = b"online", b"offline"
HUNG_UP = "the connection was lost"
REFUSES = "it refuses: "
_LOST = (
    "Disconnected during message iteration",
    "The client is not currently connected.",
    "The connection was lost.",
)
"""The libraries' words for one thing: which of them it is depends on what was under way."""
_CODES = re.compile(r"^\[[^]]*\] | \(_ssl\.c:\d+\)$")
"""What is around the words of a system's or a broker's error: [Errno 111], [code:135]."""


class Publisher:
    """Publishes what it is given; carries commands where they are enabled.

    Args:
        settings: [mqtt].
        actions: what a command may ask for.
        notices: where to tell that the broker is there or not.
        clock: monotonic time, s.
        rng: jitter of the back-off.

    Raises:
        ConfigurationError: a password, certificate or key file that cannot be used.
    """

    def __init__(
        self,
        settings: MqttSettings,
        actions: Actions,
        notices: Notices,
        *,
        clock: Callable[[], float],
        rng: random.Random | None = None,
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._commands = Commands(actions, notices, self.counters)
        self.connected = False
        self._settings = settings
        self._notices = notices
        self._clock = clock
        self._password = (
            read_secret(settings.password_file, key="[mqtt] password_file")
            if settings.password_file is not None
            else None
        )
        self._tls = tls_context(settings)
        jitter = rng if rng is not None else random.Random()  # noqa: S311 - spreads reconnects, guards nothing
        self._backoff = Backoff(jitter, limits.BACKOFF_BASE_S, limits.BACKOFF_CAP_S)
        self._outbox = Outbox()
        self._news = asyncio.Event()
        self._place = Place(settings.prefix)
        self._journal: tuple[JournalLine, ...] | None = None
        self._next_state = 0.0
        self._outage = Outage(limits.STABLE_S)
        self._refused = False
        self._hang_ups = HangUps()
        self._under_way: Parcel | None = None
        self._connected_at = 0.0
        self._closing = asyncio.Event()
        self._hurried = False
        self._diagnosed = False
        self._task: asyncio.Task[None] | None = None

    @property
    def prefix(self) -> str:
        """What all topics begin with; empty until the vehicle is known."""
        return self._place.prefix

    def publish(self, snapshot: Snapshot) -> None:
        """Take a snapshot; what is new in it goes to the broker as soon as it takes it."""
        self._place.hear(snapshot.link.system_id)
        journal = snapshot.journal
        if self._journal is not None:
            for line in newer(self._journal, journal):
                self._outbox.event("event", event_message(line))
        self._journal = journal
        now = self._clock()
        self._tell_of_recovery(now)
        if now >= self._next_state or self._closing.is_set():
            self._next_state = now + self._settings.state_interval_s
            self._outbox.retain("state", snapshot.to_json())
            self._outbox.retain("summary", summary_message(snapshot))
        if self._settings.discovery is not None and self.prefix:
            there = discovery_topic(self._settings.discovery, self.prefix)
            self._outbox.retain(f"/{there}", discovery_message(self.prefix, snapshot))
        self._outbox.retain("calibration", calibration_message(snapshot))
        if snapshot.diagnosis is not None:
            self._diagnosed = True
            self._outbox.retain("diagnosis", document(snapshot.diagnosis))
        elif self._diagnosed:
            self._outbox.retain("diagnosis", b"")  # an empty retained message is none
        self._news.set()

    async def run(self) -> None:
        """Keep the connection until :meth:`close` or cancellation."""
        self._task = asyncio.current_task()
        await self._place.named.wait()
        while not self._closing.is_set():
            began = self._clock()
            self._move()
            try:
                await self._session()
            except asyncio.CancelledError:
                if not self._closing.is_set():
                    raise
            except (aiomqtt.MqttError, OSError, TimeoutError) as error:
                self._lost(_reason(error))
            except Exception as error:
                # Whatever it is, calibrating goes on without a broker.
                if self._lost(str(error)):
                    logger.exception("MQTT failed")
            finally:
                self.connected = False
                self._under_way = None
            if self._closing.is_set():
                return
            if self._clock() - began >= limits.STABLE_S:
                self._backoff.reset()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(self._backoff.next()):
                    await self._closing.wait()

    async def close(self, last: Snapshot | None = None) -> None:
        """Send what waits, say that we are offline, and let :meth:`run` end; bounded.

        Args:
            last: the state that stays with the broker.
        """
        self._closing.set()
        if last is not None:
            self.publish(last)
        self._place.named.set()
        self._news.set()
        task = self._task
        if task is None or task.done():
            return
        await asyncio.wait((task,), timeout=limits.FAREWELL_S)
        if not task.done():
            self._hurried = True
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    # One connection

    async def _session(self) -> None:
        settings = self._settings
        self.counters["mqtt_attempts"] += 1
        client = Client(
            settings.host,
            settings.port,
            identifier=self._identifier,
            username=settings.username,
            password=self._password,
            will=aiomqtt.Will(self._place.topic("availability"), OFFLINE, qos=1, retain=True),
            tls_context=self._tls,
            keepalive=limits.KEEPALIVE_S,
            logger=library,
            timeout=limits.ANSWER_S,
            # Commands of an hour ago are not to be carried out when the line is back.
            clean_session=True,
            max_queued_incoming_messages=limits.COMMANDS_WAITING,
        )
        async with client:
            try:
                await self._talk(client)
            finally:
                if client.overlong:
                    self._commands.stop(self._clock(), self._where)
                if self._closing.is_set():  # the library disconnects with this patience
                    client.timeout = limits.HANG_UP_S

    async def _talk(self, client: aiomqtt.Client) -> None:
        """What is said from the first word to the last."""
        if self._settings.commands and not self._commands.off_for(self._clock()):
            await self._subscribe(client)
        self._outbox.connected()
        await client.publish(self._place.topic("availability"), ONLINE, qos=1, retain=True)
        self.counters["mqtt_connects"] += 1
        self.connected, self._connected_at = True, self._clock()
        if self._outage.since is None:
            self._notices.post("mqtt_connected", f"broker {self._where}: publishing")
        self._outage.works(self._clock())
        try:
            await self._speak(client)
        finally:
            # Leaving in good order keeps the broker from publishing the last will.
            with contextlib.suppress(aiomqtt.MqttError):
                await client.publish(
                    self._place.topic("availability"),
                    OFFLINE,
                    qos=1,
                    retain=True,
                    timeout=limits.HANG_UP_S if self._hurried else limits.FAREWELL_S,
                )

    async def _speak(self, client: aiomqtt.Client) -> None:
        """Send and listen, which also notices at once that the broker has gone."""
        tasks = {
            asyncio.create_task(self._listen(client), name="mqtt listener"),
            asyncio.create_task(self._send(client), name="mqtt sender"),
            asyncio.create_task(self._moving(), name="mqtt mover"),
        }
        try:
            done, _ = await asyncio.wait(
                tasks,
                return_when=asyncio.FIRST_COMPLETED,
                timeout=self._commands.off_for(self._clock()),
            )
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        for task in done:
            task.result()

    async def _subscribe(self, client: aiomqtt.Client) -> None:
        granted = await client.subscribe(self._place.topic("command"), qos=1)
        for code in granted:
            refused = (code if isinstance(code, int) else code.value) >= 0x80
            if refused and not self._refused:
                self._notices.post(
                    "mqtt_commands_refused",
                    f"broker {self._where} does not let us subscribe to commands",
                    warning=True,
                )
            self._refused = refused

    async def _send(self, client: aiomqtt.Client) -> None:
        """Send what is due; ends when closing and nothing is left."""
        while True:
            self._news.clear()
            while (parcel := self._outbox.next()) is not None:
                self._under_way = parcel
                await client.publish(
                    self._place.topic(parcel.topic), parcel.payload, qos=1, retain=parcel.retain
                )
                self._outbox.confirm(parcel)
                self._hang_ups.confirmed(parcel)
                self._under_way = None
                self.counters["mqtt_published"] += 1
            if self._closing.is_set():
                return
            await self._news.wait()

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            payload = message.payload if isinstance(message.payload, bytes) else b""
            reply = await self._commands.take(payload, retained=message.retain)
            if reply is not None:
                self._outbox.event("command/reply", document(reply))
                self._news.set()

    # How

    @property
    def _identifier(self) -> str:
        return self._settings.client_id or self.prefix.replace("/", "-")

    @property
    def _where(self) -> str:
        return f"{self._settings.host}:{self._settings.port}"

    async def _moving(self) -> None:
        """Ends the connection when everything has to be published elsewhere."""
        await self._place.moving.wait()

    def _move(self) -> None:
        """The device of a vehicle that was none is taken out of Home Assistant."""
        left = self._place.move()
        if left is not None and self._settings.discovery is not None:
            there = discovery_topic(self._settings.discovery, left)
            self._outbox.retain(f"/{there}", b"")

    def _lost(self, reason: str) -> bool:
        """Say so once for each reason, and whether that was now; every further try only counts."""
        self.counters["mqtt_failures"] += 1
        if not self.connected:
            self._hang_ups.absent()
        elif reason == HUNG_UP:
            reason = self._hung_up()
        now = self._clock()
        if self.connected:
            told = self._outage.lost(reason, now)
        else:
            told = self._outage.failed(reason, now, refused=reason.startswith(REFUSES))
        if told:
            text = f"broker {self._where}: {reason}; tried again until it answers"
            self._notices.post("mqtt_lost", text, warning=True)
        else:
            logger.debug("broker %s: %s", self._where, reason)
        return told

    def _hung_up(self) -> str:
        """The broker has ended a good connection: why, as far as its ways tell."""
        parcel = self._under_way
        if self._hang_ups.take(parcel, self._clock() - self._connected_at) and parcel is not None:
            self._outbox.too_large = size = len(parcel.payload)
            self._notices.post(
                "mqtt_too_large",
                f"broker {self._where} hangs up at {size} bytes ({parcel.topic.lstrip('/')}): "
                "nothing as large is published; see its limit for packets",
                warning=True,
            )
        elif self._hang_ups.again_and_again:
            return (
                "no connection lasts for two minutes: does another client have the id "
                f"{self._identifier}? ([mqtt] client_id and prefix)"
            )
        return HUNG_UP

    def _tell_of_recovery(self, now: float) -> None:
        lasted = now - self._connected_at
        if self._hang_ups.again_and_again and not (self.connected and lasted >= limits.LASTING_S):
            return  # what comes and goes is told of once
        over = self._outage.over(now)
        if over is not None:
            text = f"broker {self._where}: publishing again after {over}"
            lost, self._outbox.dropped = self._outbox.dropped, 0
            if lost:
                text += f", without the oldest {lost} of its events"
            self._notices.post("mqtt_connected", text)


def _reason(error: Exception) -> str:
    """Why there is no connection, in a few words."""
    text = _CODES.sub("", str(error) or type(error).__name__)
    if isinstance(error, aiomqtt.exceptions.MqttConnectError):
        return f"{REFUSES}{text}"
    return HUNG_UP if text in _LOST else text
