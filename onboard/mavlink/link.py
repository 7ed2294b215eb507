"""The link: several endpoints, one autopilot, messages handed to whoever asked for them."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import Callable, Iterable, Sequence

from onboard.errors import LinkError
from onboard.mavlink import limits
from onboard.mavlink.audience import Audience, EventHandler, Handler
from onboard.mavlink.autopilot import (
    Autopilot,
    AutopilotFound,
    AutopilotRebooted,
    AutopilotState,
    ConnectionChanged,
    ConnectionRestored,
    ConnectionTrouble,
    Participant,
)
from onboard.mavlink.bootclock import STAMPED, BootClock
from onboard.mavlink.codec import Codec, Frame
from onboard.mavlink.connection import Connection
from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.presence import Presence
from onboard.mavlink.recorder import Recorder
from onboard.mavlink.routes import Routes
from onboard.mavlink.signing import Signing
from onboard.outage import Over

_HEARTBEAT = int(mavlink.MAVLINK_MSG_ID_HEARTBEAT)


class Link:
    """MAVLink over any number of endpoints.

    Handlers run in the loop's reader callback, so they must be quick and must not block; an
    exception in one ends :meth:`run` with it.  Where the autopilot is heard on several
    endpoints, one is in use and the others stand by.

    Args:
        endpoints: where to listen and connect.
        system: the vehicle's system id if only that one is to be used; None takes the first
            autopilot heard, and its system id becomes ours.
        signing: sign and verify; None for plain MAVLink 2.
        recorder: gets every frame handed on and every frame sent.
        clock: monotonic time, s; what handlers and participants get as ``now``.
        wall_clock: unix time, s, for the recording.
        rng: jitter of the back-off.
        linger: longest delay of a message for the sake of fewer wake-ups, s.
    """

    def __init__(
        self,
        endpoints: Sequence[Endpoint],
        *,
        system: int | None = None,
        signing: Signing | None = None,
        recorder: Recorder | None = None,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
        rng: random.Random | None = None,
        linger: float = limits.LINGER_S,
    ) -> None:
        self.boot_clock = BootClock()
        self.routes = Routes(system or 1)
        self._presence = Presence(system)
        self._recorder = recorder
        self._clock = clock
        self._wall_clock = wall_clock
        self._audience = Audience((_HEARTBEAT,))
        jitter = rng if rng is not None else random.Random()  # noqa: S311 - spreads reconnects, guards nothing
        wanted = self._audience.wanted
        self.connections = tuple(
            Connection(
                endpoint,
                Codec(system=system or 1, wanted=wanted, signing=signing, link_id=number),
                receive=self._received,
                changed=self._connection_changed,
                tell=self._connection_told,
                clock=clock,
                rng=jitter,
                linger=linger,
            )
            for number, endpoint in enumerate(endpoints)
        )
        self._participants: list[Participant] = []
        self._next_beat = 0.0
        self._found = asyncio.Event()
        self._stopped: asyncio.Future[None] | None = None
        self._closed = False
        self.subscribe(self._watch_boot_clock, STAMPED)

    @property
    def autopilot(self) -> Autopilot | None:
        """Who was found; None before its first HEARTBEAT."""
        return self._presence.autopilot

    @property
    def state(self) -> AutopilotState:
        """Whether it is heard now."""
        return self._presence.state

    # Who gets what

    def subscribe(self, handler: Handler, names: Iterable[str]) -> None:
        """Have ``handler(now, message)`` called for each of these messages, in order of arrival.

        Raises:
            ValueError: the dialect has no such message.
        """
        self._audience.add(handler, names)
        for connection in self.connections:
            connection.codec.wanted = self._audience.wanted

    def subscribe_events(self, handler: EventHandler) -> None:
        """Have ``handler(now, event)`` called for what happens to autopilot and connections."""
        self._audience.add_for_events(handler)

    def attach(self, participant: Participant) -> None:
        """Drive a sans-IO protocol: feed it, poll it, send what it returns."""
        self._participants.append(participant)

        def feed(now: float, message: Message) -> None:
            for answer in participant.feed(message, now):
                self.send(answer)

        self.subscribe(feed, participant.names)
        if self.autopilot is not None:
            participant.start(self.autopilot.system, self.autopilot.component, self._clock())

    # Life

    async def run(self) -> None:
        """Keep the link until :meth:`close` or cancellation.

        Raises:
            EndpointError: an endpoint cannot be opened at all (port in use, no permission).
            Exception: whatever a handler raised.
        """
        self._stopped = asyncio.get_running_loop().create_future()
        if self._closed:
            self._stopped.set_result(None)
        try:
            async with asyncio.TaskGroup() as group:
                tasks = [
                    group.create_task(connection.run(), name=f"link {connection.endpoint}")
                    for connection in self.connections
                ]
                tasks.append(group.create_task(self._tick_forever(), name="link tick"))
                if self._recorder is not None:
                    recording = self._recorder.run()
                    tasks.append(group.create_task(recording, name="link recorder"))
                await self._stopped
                for task in tasks:
                    task.cancel()
        except BaseExceptionGroup as failures:
            raise failures.exceptions[0] from None

    def close(self) -> None:
        """Let :meth:`run` end: connections close, the recording is written out."""
        self._closed = True
        if self._stopped is not None and not self._stopped.done():
            self._stopped.set_result(None)

    async def wait_autopilot(self, timeout: float) -> Autopilot:  # noqa: ASYNC109 - the error names every endpoint's state
        """The autopilot, once it is heard.

        Raises:
            LinkError: no HEARTBEAT of an autopilot within ``timeout`` seconds.
        """
        try:
            async with asyncio.timeout(timeout):
                await self._found.wait()
        except TimeoutError:
            where = "; ".join(
                f"{c.endpoint} ({c.last_error or c.state.value})" for c in self.connections
            )
            raise LinkError(f"no heartbeat from an autopilot in {timeout:g} s: {where}") from None
        if self.autopilot is None:
            raise LinkError("the link was closed before an autopilot was heard")
        return self.autopilot

    # Sending

    def send(self, message: Message) -> None:
        """Send a message under our ids: to where its target was heard, else everywhere."""
        route = self.routes.to(message)
        chosen = self.connections if route is None else (route,)
        recorder = self._recorder
        for connection in chosen:
            if connection.is_up:
                frame = connection.codec.encode(message)
                connection.write(frame)
                if recorder is not None:
                    recorder.write(self._wall_clock(), frame)
                    recorder = None

    # Receiving

    def _received(self, connection: Connection, data: bytes) -> None:
        try:
            self._hand_on(connection, connection.codec.feed(data))
        except Exception as error:  # noqa: BLE001 - handlers are others' code: their failure must end run(), not vanish in the loop
            if self._stopped is not None and not self._stopped.done():
                self._stopped.set_exception(error)

    def _hand_on(self, connection: Connection, frames: list[Frame]) -> None:
        now = self._clock()
        wall = self._wall_clock()
        recorder = self._recorder
        for frame in frames:
            source = (frame.system, frame.component)
            if not self.routes.accepts(source, connection, now):
                continue
            if recorder is not None:
                recorder.write(wall, frame.raw)
            if frame.message is None:
                continue
            if frame.message_id == _HEARTBEAT:
                self._heartbeat(connection, source, frame.message, now)
            self._audience.hear(now, frame.message_id, frame.message)

    def _heartbeat(
        self, connection: Connection, source: tuple[int, int], message: Message, now: float
    ) -> None:
        event = self._presence.heartbeat(source, message, now)
        if isinstance(event, AutopilotFound):
            self.routes.settle(source, connection, now)
            for other in self.connections:
                other.codec.system = source[0]
            self._found.set()
        if event is not None:
            self._audience.hear_of(now, event)
            self._restart_participants(now)

    def _watch_boot_clock(self, now: float, message: Message) -> None:
        if (message.get_srcSystem(), message.get_srcComponent()) != self.routes.autopilot:
            return
        if self.boot_clock.observe(message):
            self._audience.hear_of(now, AutopilotRebooted(self.boot_clock.reboots))
            self._restart_participants(now)

    # Time

    async def _tick_forever(self) -> None:
        while True:
            self._tick(self._clock())
            await asyncio.sleep(limits.TICK_S)

    def _tick(self, now: float) -> None:
        if now >= self._next_beat:
            self._next_beat = now + limits.HEARTBEAT_INTERVAL_S
            self.send(_our_heartbeat())  # over UDP it also tells the peer where we are
        for connection in self.connections:
            connection.check(now)
        silent = self._presence.check(now)
        if silent is not None:
            self._audience.hear_of(now, silent)
        if self.state is AutopilotState.PRESENT:
            for participant in self._participants:
                for message in participant.poll(now):
                    self.send(message)

    def _restart_participants(self, now: float) -> None:
        if self.routes.autopilot is not None:
            for participant in self._participants:
                participant.start(*self.routes.autopilot, now)

    def _connection_changed(self, connection: Connection, reason: str) -> None:
        if connection.is_up:
            self._next_beat = self._clock()
        self._audience.hear_of(
            self._clock(), ConnectionChanged(connection.endpoint, connection.state, reason)
        )

    def _connection_told(self, connection: Connection, news: str | Over) -> None:
        now, endpoint = self._clock(), connection.endpoint
        if isinstance(news, Over):
            self._audience.hear_of(now, ConnectionRestored(endpoint, news))
        else:
            self._audience.hear_of(now, ConnectionTrouble(endpoint, news))


def _our_heartbeat() -> Message:
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_AUTOPILOT_INVALID,
        0,
        0,
        mavlink.MAV_STATE_ACTIVE,
        3,
    )
