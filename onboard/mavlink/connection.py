"""One endpoint kept open: reconnection as an explicit state machine with full-jitter back-off."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Iterator
from enum import Enum

from onboard.errors import UnavailableError
from onboard.mavlink import limits
from onboard.mavlink.codec import Codec, CodecStatistics, Frame
from onboard.mavlink.endpoint import Endpoint, EndpointError, EndpointKind
from onboard.mavlink.peers import Address, Peer, Peers
from onboard.mavlink.transport import Transport, open_transport
from onboard.outage import Outage, Over


class ConnectionState(Enum):
    """Where a connection is in its life."""

    IDLE = "idle"
    CONNECTING = "connecting"
    UP = "up"
    WAITING = "waiting"
    CLOSED = "closed"


_S = ConnectionState
TRANSITIONS: dict[ConnectionState, frozenset[ConnectionState]] = {
    _S.IDLE: frozenset({_S.CONNECTING, _S.CLOSED}),
    _S.CONNECTING: frozenset({_S.UP, _S.WAITING, _S.CLOSED}),
    _S.UP: frozenset({_S.WAITING, _S.CLOSED}),
    _S.WAITING: frozenset({_S.CONNECTING, _S.CLOSED}),
    _S.CLOSED: frozenset(),
}


class Backoff:
    """Full jitter: the n-th wait is uniform between 0 and ``min(cap, base 2^n)``."""

    def __init__(
        self,
        rng: random.Random,
        base: float = limits.BACKOFF_BASE_S,
        cap: float = limits.BACKOFF_CAP_S,
    ) -> None:
        self._rng = rng
        self._base = base
        self._cap = cap
        self._attempt = 0

    def next(self) -> float:
        """How long to wait now, s."""
        ceiling = min(self._cap, self._base * 2.0 ** min(self._attempt, 30))
        self._attempt += 1
        return self._rng.uniform(0.0, ceiling)

    def reset(self) -> None:
        """Start again from the base."""
        self._attempt = 0


class Connection:
    """Keeps one endpoint open for as long as :meth:`run` runs.

    Args:
        endpoint: where to.
        make_codec: framing, a new one for each peer.
        receive: called with (connection, peer, frames).
        changed: called with (connection, reason) after each change of state.
        tell: called with (connection, news) when trouble begins or has another reason (that
            reason), and when it is over.
        clock: monotonic time, s.
        rng: source of the jitter.
        linger: see :mod:`onboard.mavlink.transport`; :meth:`pace` changes it.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        make_codec: Callable[[], Codec],
        *,
        receive: Callable[[Connection, Peer, list[Frame]], None],
        changed: Callable[[Connection, str], None],
        tell: Callable[[Connection, str | Over], None],
        clock: Callable[[], float],
        rng: random.Random,
        linger: float = limits.LINGER_S,
    ) -> None:
        self.endpoint = endpoint
        self.codec = make_codec()
        """Packs what is sent; what comes is opened by the peers'."""
        self.peers = Peers(make_codec, addressed=endpoint.kind is EndpointKind.UDP_IN)
        self.state = ConnectionState.IDLE
        self.last_error = ""
        self.connects = 0
        self.failures = 0
        self.outage = Outage(limits.STABLE_S)
        self._dropped = 0
        self._refused = 0
        self.last_received: float | None = None
        self._receive = receive
        self._changed = changed
        self._tell = tell
        self._clock = clock
        self._linger = linger
        self._backoff = Backoff(rng)
        self._transport: Transport | None = None
        self._broken: asyncio.Future[str] | None = None

    @property
    def is_up(self) -> bool:
        """Whether bytes can flow."""
        return self.state is ConnectionState.UP

    @property
    def dropped(self) -> int:
        """Frames that could not be sent: no connection, no peer yet, or a stalled line."""
        return self._dropped + (self._transport.dropped if self._transport is not None else 0)

    @property
    def refused(self) -> int:
        """Reads that were not looked at: beyond a sender's queue or ration, or without room."""
        waiting = self._transport.refused if self._transport is not None else 0
        return self.peers.refused + self._refused + waiting

    def statistics(self) -> Iterator[CodecStatistics]:
        """What was counted, of what was sent and of each peer."""
        yield self.codec.statistics
        yield from self.peers.statistics()

    def write(self, data: bytes, to: Address | None = None) -> None:
        """Send if the connection is up; count the loss if not.

        Args:
            data: a frame.
            to: one address of a listening socket; None: everybody there who speaks MAVLink.
        """
        if self._transport is None:
            self._dropped += 1
        elif to is not None:
            self._transport.write(data, (to,))
        else:
            self._transport.write(data, self.peers.answered(self._clock()))

    def pace(self, linger: float) -> None:
        """From now on a message waits for ``linger`` seconds at most."""
        if linger != self._linger:
            self._linger = linger
            if self._transport is not None:
                self._transport.pace(linger)

    def read(self) -> None:
        """Read what has come, without waiting for its time."""
        if self._transport is not None:
            self._transport.read()

    def check(self, now: float) -> None:
        """See whether trouble is over; break a TCP or serial line that is silent for too long."""
        over = self.outage.over(now)
        if over is not None:
            self._tell(self, over)
        if (
            self._is_stream
            and self.last_received is not None
            and self.is_up
            and now - self.last_received > limits.SILENCE_S
        ):
            self._lost(f"nothing received for {limits.SILENCE_S:.0f} s")

    async def run(self) -> None:
        """Connect, and connect again, until cancelled.

        Raises:
            EndpointError: the endpoint cannot be opened at all (not once it has been up).
            UnavailableError: nor now, for it is another program's (nor that).
        """
        try:
            while True:
                reason = await self._connect_once()
                self.last_error = reason
                self._troubled(reason)
                self._enter(ConnectionState.WAITING, reason)
                await asyncio.sleep(self._backoff.next())
        finally:
            self._drop_transport()
            self._enter(ConnectionState.CLOSED, "")

    async def _connect_once(self) -> str:
        """One connection from opening to its end; the reason of the end."""
        self._enter(ConnectionState.CONNECTING, "")
        broken = self._broken = asyncio.get_running_loop().create_future()
        try:
            self._transport = await open_transport(
                self.endpoint,
                self._received,
                self._lost,
                linger=self._linger,
                first=self.peers.is_vehicle,
            )
        except (EndpointError, UnavailableError) as error:
            if not self.connects:
                raise
            return str(error)
        except TimeoutError:
            return "timed out"
        except OSError as error:
            return error.strerror or str(error)
        self._transport.pace(self._linger)  # it may have changed meanwhile
        self.connects += 1
        self.peers.begin_anew()
        since = self.last_received = self._clock()
        self._enter(ConnectionState.UP, "")
        if not self._is_stream:
            self.outage.works(since)
        try:
            reason: str = await broken
        finally:
            self._drop_transport()
        if self._clock() - since >= limits.STABLE_S:
            self._backoff.reset()
        return reason

    @property
    def _is_stream(self) -> bool:
        return self.endpoint.kind in (EndpointKind.TCP, EndpointKind.SERIAL)

    def _troubled(self, reason: str) -> None:
        """Tell it, if it is news."""
        now = self._clock()
        if self.is_up:
            # A line that says nothing is given up late: it was lost when the last byte had come.
            last = self.last_received if self._is_stream else None
            news = self.outage.lost(reason, now if last is None else last)
        else:
            self.failures += 1
            news = self.outage.failed(reason, now)
        if news:
            self._tell(self, reason)

    def _received(self, data: bytes, address: Address | None = None) -> None:
        now = self.last_received = self._clock()
        # A line that opens and stays dumb is no better than one that does not open.
        self.outage.works(now)
        peer, frames = self.peers.feed(address, data, now)
        if frames:
            self._receive(self, peer, frames)

    def _lost(self, reason: str) -> None:
        if self._broken is not None and not self._broken.done():
            self._broken.set_result(reason)

    def _drop_transport(self) -> None:
        if self._transport is not None:
            self._dropped += self._transport.dropped
            self._refused += self._transport.refused
            self._transport.close()
            self._transport = None

    def _enter(self, state: ConnectionState, reason: str) -> None:
        if state not in TRANSITIONS[self.state]:
            raise RuntimeError(f"{self.endpoint}: no way from {self.state} to {state}")
        self.state = state
        self._changed(self, reason)
