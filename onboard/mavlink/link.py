"""The link: several endpoints, one autopilot, messages handed to whoever asked for them."""

from __future__ import annotations

import asyncio
import math
import random
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial

from onboard.errors import LinkError
from onboard.mavlink import framing, limits
from onboard.mavlink.audience import Audience, EventHandler, Handler
from onboard.mavlink.autopilot import (
    Autopilot,
    AutopilotFound,
    AutopilotRebooted,
    AutopilotReturned,
    AutopilotState,
    ConnectionChanged,
    ConnectionRestored,
    ConnectionTrouble,
    Participant,
    RivalHeard,
)
from onboard.mavlink.bootclock import STAMPED, BootClock, boot_seconds
from onboard.mavlink.claims import Source, Way
from onboard.mavlink.codec import Codec, Frame
from onboard.mavlink.connection import Connection
from onboard.mavlink.decode import is_autopilot
from onboard.mavlink.dialect import COMPONENT, MESSAGE_IDS, Message, mavlink
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.peers import Address, Merit, Peer
from onboard.mavlink.presence import Presence, Whose
from onboard.mavlink.recorder import Recorder
from onboard.mavlink.routes import Routes
from onboard.mavlink.signing import Signing
from onboard.mavlink.twins import Twins, our_heartbeat, our_tunnel, signature_of
from onboard.outage import Over

_HEARTBEAT = int(mavlink.MAVLINK_MSG_ID_HEARTBEAT)
_TUNNEL = int(mavlink.MAVLINK_MSG_ID_TUNNEL)
_STAMPED = frozenset(MESSAGE_IDS[name] for name in STAMPED)


class Link:
    """MAVLink over any number of endpoints.

    Handlers run in the loop's reader callback, so they must be quick and must not block; an
    exception in one ends :meth:`run` with it.  The vehicle is one source on one way
    (:mod:`onboard.mavlink.presence`): what comes from there is handed on, what claims to be it and
    comes from elsewhere is counted; what is addressed to it goes there and nowhere else.

    Args:
        endpoints: where to listen and connect.
        system: the vehicle's system id if only that one is to be used; None takes the first
            that proves to be an autopilot, and its system id becomes ours.
        component: its component id, likewise.
        signing: sign and verify; None for plain MAVLink 2.
        recorder: gets every frame handed on and every frame sent.
        clock: monotonic time, s; what handlers and participants get as ``now``.
        wall_clock: unix time, s, for the recording.
        rng: jitter of the back-off.
        linger: longest delay of a message for the sake of fewer wake-ups, s, while somebody waits
            for an answer or a push is under way.
        rest: the same at all other times; each tick reads what has come by then.
    """

    def __init__(
        self,
        endpoints: Sequence[Endpoint],
        *,
        system: int | None = None,
        component: int | None = None,
        signing: Signing | None = None,
        recorder: Recorder | None = None,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
        rng: random.Random | None = None,
        linger: float = limits.LINGER_S,
        rest: float = limits.REST_S,
    ) -> None:
        self.boot_clock = BootClock()
        self.presence = Presence(system, component)
        self.twins = Twins(clock)
        self.echoed = 0
        """Our own packets that came back."""
        self.signed = False
        """Whether the vehicle's last HEARTBEAT was signed, by whatever key."""
        self._routes = Routes()
        self._signing = signing
        self.recorder = recorder
        """One that is put here later is run by who does that."""
        self._clock = clock
        self._wall_clock = wall_clock
        self._audience = Audience((_HEARTBEAT, _TUNNEL, *_STAMPED))
        self._own: Source = (system or 1, COMPONENT)
        jitter = rng if rng is not None else random.Random()  # noqa: S311 - spreads reconnects, guards nothing
        self.connections = tuple(
            Connection(
                endpoint,
                partial(self._make_codec, number),
                receive=partial(self._received, number),
                changed=self._connection_changed,
                tell=self._connection_told,
                clock=clock,
                rng=jitter,
                linger=linger,
            )
            for number, endpoint in enumerate(endpoints)
        )
        self._participants: list[Participant] = []
        self._linger, self._rest = linger, max(linger, rest)
        self._asked_at = -math.inf
        self._next_beat = 0.0
        self._found = asyncio.Event()
        self._stopped: asyncio.Future[None] | None = None
        self._closed = False
        self.subscribe(self._watch_boot_clock, STAMPED)

    @property
    def autopilot(self) -> Autopilot | None:
        """Who was found; None before its first HEARTBEAT."""
        return self.presence.autopilot

    @property
    def state(self) -> AutopilotState:
        """Whether it is heard now."""
        return self.presence.state

    @property
    def unsigned_beats(self) -> int:
        """HEARTBEATs of autopilots that were not believed: they were not signed with our key."""
        return sum(s.unsigned_beats for c in self.connections for s in c.statistics())

    # Who gets what

    def subscribe(self, handler: Handler, names: Iterable[str]) -> None:
        """Have ``handler(now, message)`` called for each of these messages, in order of arrival.

        Raises:
            ValueError: the dialect has no such message.
        """
        self._audience.add(handler, names)
        for connection in self.connections:
            for peer in connection.peers:
                peer.codec.wanted = self._audience.wanted

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
            EndpointError: an endpoint cannot be opened at all.
            UnavailableError: nor now, for it is another program's.
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
                if self.recorder is not None:
                    recording = self.recorder.run()
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
            if self.unsigned_beats:
                where += "; heartbeats come that are not signed with our key"
            raise LinkError(f"no heartbeat from an autopilot in {timeout:g} s: {where}") from None
        if self.autopilot is None:
            raise LinkError("the link was closed before an autopilot was heard")
        return self.autopilot

    # Sending

    def send(self, message: Message) -> None:
        """Send a message under our ids: to where its target was heard, else everywhere."""
        recorder = self.recorder
        if getattr(message, "target_system", 0):
            self._wait_for_answers()
        for connection, address in self._ways_to(message):
            if connection.is_up:
                frame = connection.codec.encode(message)
                connection.write(frame, address)
                if recorder is not None:
                    recorder.write(self._wall_clock(), frame)
                    recorder = None

    def _ways_to(self, message: Message) -> Iterable[tuple[Connection, Address | None]]:
        """Where its target was heard; every endpoint where that is not known or is down."""
        way = self._routes.to(message, self.presence.source, self.presence.way)
        if way is not None and self.connections[way[0]].is_up:
            return ((self.connections[way[0]], way[1]),)
        return ((connection, None) for connection in self.connections)

    def _wait_for_answers(self) -> None:
        """Somebody was asked or told something: the answer is not to be left lying."""
        self._asked_at = self._clock()
        for connection in self.connections:
            connection.pace(self._linger)

    # Receiving

    def _make_codec(self, number: int) -> Codec:
        signing = None if self._signing is None else self._signing.of_a_way()
        system, wanted = self._own[0], self._audience.wanted
        return Codec(system=system, wanted=wanted, signing=signing, link_id=number)

    def _received(
        self, number: int, _connection: Connection, peer: Peer, frames: list[Frame]
    ) -> None:
        try:
            self._hand_on((number, peer.address), peer, frames)
        except Exception as error:  # noqa: BLE001 - handlers are others' code: their failure must end run(), not vanish in the loop
            if self._stopped is not None and not self._stopped.done():
                self._stopped.set_exception(error)

    def _hand_on(self, way: Way, peer: Peer, frames: list[Frame]) -> None:
        now = self._clock()
        wall = self._wall_clock()
        recorder = self.recorder
        for frame in frames:
            if not self._is_believed((frame.system, frame.component), way, peer, frame, now):
                continue
            if recorder is not None:
                recorder.write(wall, frame.raw)
            if frame.message is not None:
                self._audience.hear(now, frame.message_id, frame.message)

    def _is_believed(self, source: Source, way: Way, peer: Peer, frame: Frame, now: float) -> bool:
        """Take note of a packet; whether it is to be handed on."""
        if source == self._own:
            self.echoed += 1
            self._heard_own_name(frame, now)
            return False
        if not self._counts(frame):
            # Nobody can vouch for it: it is no sign of life of the vehicle, and moves nothing.
            return self._signing is None and source != self.presence.source
        message = frame.message
        boot = None
        if message is not None and frame.message_id in _STAMPED:
            boot = boot_seconds(message)
        heard = self.presence.hear(source, way, message, boot, now)
        if heard.whose is Whose.VEHICLE:
            self.connections[way[0]].peers.believe(peer, now)
            if frame.message_id == _HEARTBEAT:
                self.signed = framing.header(frame.raw, 0).signed
        for event in heard.events:
            self._tell(event, peer, now)
        if heard.whose is Whose.STANDBY or heard.whose is Whose.FOREIGN:
            return False
        if self._signing is not None:
            self._signing.act_on(frame.raw)
        if heard.whose is Whose.SOMEBODY:
            if message is not None and is_autopilot(message):
                peer.rise(Merit.CLAIMS, now)
            self._routes.note(source, way)
        return True

    def _counts(self, frame: Frame) -> bool:
        """Whether a packet is of a kind that we know and, where that is demanded, signed."""
        if frame.message_id not in mavlink.mavlink_map:
            return False
        return self._signing is None or framing.header(frame.raw, 0).signed

    def _tell(
        self, event: AutopilotFound | AutopilotReturned | RivalHeard, peer: Peer, now: float
    ) -> None:
        """Somebody was found, is back, or is contradicted."""
        if isinstance(event, AutopilotFound):
            for other in (p for c in self.connections for p in c.peers if p is not peer):
                other.merit = min(other.merit, Merit.CLAIMS)
            self._own = (event.autopilot.system, COMPONENT)
            for connection in self.connections:
                connection.codec.system = event.autopilot.system
            if self._found.is_set():
                self.boot_clock.begin_anew()
            self._found.set()
        self._audience.hear_of(now, event)
        if not isinstance(event, RivalHeard):
            self._restart_participants(now)

    def _heard_own_name(self, frame: Frame, now: float) -> None:
        """Somebody sends under our own ids: a router that gives us back, or a second service."""
        if frame.message is None or not self._counts(frame):
            return
        signature = signature_of(frame.message)
        event = None if signature is None else self.twins.hear(signature, now)
        if event is not None:
            self._audience.hear_of(now, event)

    def _watch_boot_clock(self, now: float, message: Message) -> None:
        if (message.get_srcSystem(), message.get_srcComponent()) != self.presence.source:
            return
        clock = self.boot_clock
        if clock.observe(message, now):
            self._audience.hear_of(now, AutopilotRebooted(clock.reboots, unseen=clock.unseen))
            self._restart_participants(now)

    # Time

    async def _tick_forever(self) -> None:
        while True:
            # Before anything is asked or written: what has come may forbid it.
            for connection in self.connections:
                connection.read()
            await asyncio.sleep(self._tick(self._clock()))

    def _tick(self, now: float) -> float:
        """Say what is due; how long until the next one, s."""
        brief = self.presence.held() or now - self._asked_at < limits.ASKING_S
        for connection in self.connections:
            connection.pace(self._linger if brief else self._rest)
        if now >= self._next_beat:
            self._next_beat = now + limits.HEARTBEAT_INTERVAL_S
            signature = self.twins.signature(now)
            self.send(our_heartbeat(signature))  # over UDP it also tells the peer where we are
            self.send(our_tunnel(signature))
        for connection in self.connections:
            connection.check(now)
        silent = self.presence.check(now)
        if silent is not None:
            self._audience.hear_of(now, silent)
        if self.state is AutopilotState.PRESENT:
            for participant in self._participants:
                for message in participant.poll(now):
                    self.send(message)
                    brief = True  # a list is sent at a pace of its own, in parts
        return limits.TICK_S if brief else limits.REST_TICK_S

    def _restart_participants(self, now: float) -> None:
        if self.presence.source is not None:
            for participant in self._participants:
                participant.start(*self.presence.source, now)

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
