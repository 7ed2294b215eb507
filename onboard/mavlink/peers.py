"""Who speaks on one endpoint: a bounded table, filled by merit and not by order of arrival.

A datagram socket hears anybody.  Each address has its own framing, its own ration of bytes and its
own standing: who says nothing that a checksum confirms gives way to whoever does, and the vehicle
never gives way.  A serial line or a TCP connection has one peer, without an address.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TypeAlias

from onboard.mavlink import limits
from onboard.mavlink.codec import Codec, CodecStatistics, Frame
from onboard.mavlink.decode import is_autopilot

Address: TypeAlias = tuple[object, ...]
"""As the socket has it: host and port first."""


_COUNTED = ("bytes_received", "frames", "bad_bytes", "bad_frames")
_REFUSED = ("bad_signatures", "unsigned_beats", "unknown")


class Merit(IntEnum):
    """What a peer has shown so far."""

    NOISE = 0
    SPEAKS = 1
    CLAIMS = 2
    VEHICLE = 3


@dataclass(slots=True)
class Ration:
    """How much may still come: ``rate`` a second, saved up for a second at most."""

    rate: float
    left: float = 0.0
    at: float = -math.inf

    def take(self, amount: float, now: float) -> bool:
        """Whether so much more may come now."""
        self.left = min(self.rate, self.left + max(0.0, now - self.at) * self.rate)
        self.at = now
        if self.left < amount:
            return False
        self.left -= amount
        return True


@dataclass(slots=True)
class Peer:
    """One address: its framing, when it was heard, and what it has shown."""

    address: Address | None
    codec: Codec
    heard: float
    merit: Merit = Merit.NOISE
    claimed_at: float | None = None
    ration: Ration = field(default_factory=lambda: Ration(limits.PEER_BYTES_S))

    def standing(self, now: float) -> Merit:
        """Its merit now: to call oneself an autopilot and prove nothing wears off."""
        if (
            self.merit is Merit.CLAIMS
            and self.claimed_at is not None
            and now - self.claimed_at > limits.PROOF_S
        ):
            return Merit.SPEAKS
        return self.merit

    def rise(self, merit: Merit, now: float) -> None:
        """It has shown this much."""
        if merit > self.merit:
            self.merit = merit
            if merit is Merit.CLAIMS:
                self.claimed_at = now


class Peers:
    """The table of one endpoint.

    Args:
        make_codec: framing for a newcomer.
        addressed: whether peers have addresses (a listening datagram socket).
    """

    def __init__(self, make_codec: Callable[[], Codec], *, addressed: bool) -> None:
        self.refused = 0
        """Reads that were not looked at: too much, or no room for whoever sent it."""
        self.gone = CodecStatistics()
        """What was counted of those that have left the table."""
        self._make_codec = make_codec
        self._addressed = addressed
        self._table: dict[Address | None, Peer] = {}
        self._newcomers = Ration(limits.NEWCOMERS_HZ)

    def __iter__(self) -> Iterator[Peer]:
        return iter(self._table.values())

    def get(self, address: Address | None) -> Peer | None:
        """The peer at an address, None if it is not in the table."""
        return self._table.get(address)

    def is_vehicle(self, address: Address | None) -> bool:
        """Whether the vehicle is heard from there."""
        peer = self._table.get(address)
        return peer is not None and peer.merit is Merit.VEHICLE

    def believe(self, vehicle: Peer, now: float) -> None:
        """The vehicle was heard from this peer: whoever it was before is no more than the others.

        A vehicle comes from another port whenever a router is restarted.  Ports that it had would
        fill the table, for the vehicle never gives way, until it were not let in itself.
        """
        if vehicle.merit is Merit.VEHICLE:
            return
        for peer in self._table.values():
            if peer.merit is Merit.VEHICLE:
                peer.merit = Merit.SPEAKS
        vehicle.rise(Merit.VEHICLE, now)

    def begin_anew(self) -> None:
        """The connection was made anew: half a packet from before means nothing."""
        if not self._addressed:
            for peer in self._table.values():
                self._forget(peer)
            self._table.clear()

    def feed(self, address: Address | None, data: bytes, now: float) -> tuple[Peer, list[Frame]]:
        """Take what came from an address; the frames that it completes (none if it was refused)."""
        known = self._table.get(address)
        peer = known or Peer(address, self._make_codec(), now)
        if self._addressed and not self._allowed(peer, len(data), now, new=known is None):
            self.refused += 1
            return peer, []
        before = peer.codec.statistics.frames + peer.codec.statistics.bad_signatures
        frames = peer.codec.feed(data)
        peer.heard = now
        if known is None and any(_is_claim(frame) for frame in frames):
            # Before its place is decided on: everybody speaks, not everybody is an autopilot.
            peer.rise(Merit.CLAIMS, now)
        if peer.codec.statistics.frames + peer.codec.statistics.bad_signatures > before:
            peer.rise(Merit.SPEAKS, now)
        if known is None and not self._admit(peer, now):
            self.refused += 1
            return peer, []
        return peer, frames

    def answered(self, now: float) -> list[Address]:
        """Addresses that get what is for everybody: who speaks MAVLink, the best ones."""
        speaking = [
            peer
            for peer in self._table.values()
            if peer.merit > Merit.NOISE and now - peer.heard <= limits.PEER_SILENCE_S
        ]
        speaking.sort(key=lambda peer: peer.standing(now), reverse=True)
        return [p.address for p in speaking[: limits.PEER_LIMIT] if p.address is not None]

    def statistics(self) -> Iterator[CodecStatistics]:
        """What was counted of everybody."""
        yield self.gone
        for peer in self._table.values():
            yield peer.codec.statistics

    def _allowed(self, peer: Peer, size: int, now: float, *, new: bool) -> bool:
        vehicle = peer.merit is Merit.VEHICLE
        peer.ration.rate = limits.VEHICLE_BYTES_S if vehicle else limits.PEER_BYTES_S
        if new and len(self._table) >= limits.PEERS_KNOWN and not self._newcomers.take(1.0, now):
            return False
        return peer.ration.take(size, now)

    def _admit(self, newcomer: Peer, now: float) -> bool:
        """Whether there is room, or somebody of less merit (or long silent) who makes it."""
        if len(self._table) >= limits.PEERS_KNOWN:
            weakest = min(self._table.values(), key=lambda peer: (peer.standing(now), peer.heard))
            silent = now - weakest.heard > limits.PEER_SILENCE_S
            if weakest.merit is Merit.VEHICLE or not (
                silent or newcomer.merit > weakest.standing(now)
            ):
                return False
            self._forget(weakest)
            del self._table[weakest.address]
        self._table[newcomer.address] = newcomer
        return True

    def _forget(self, peer: Peer) -> None:
        statistics = peer.codec.statistics
        for name in _COUNTED + _REFUSED:
            total = getattr(self.gone, name) + getattr(statistics, name)
            setattr(self.gone, name, total)


def _is_claim(frame: Frame) -> bool:
    """Whether it is a HEARTBEAT of an autopilot."""
    return frame.message is not None and is_autopilot(frame.message)
