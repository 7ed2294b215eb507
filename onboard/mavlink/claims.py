"""Who calls himself an autopilot, by which way, and what he has shown for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.mavlink import limits
from onboard.mavlink.dialect import Message
from onboard.mavlink.peers import Address

Source: TypeAlias = tuple[int, int]
"""System and component."""
Way: TypeAlias = tuple[int, Address | None]
"""Number of the endpoint, and the address there."""


@dataclass(slots=True)
class Claim:
    """One source on one way that has sent an autopilot's HEARTBEAT; times are the link's, s.

    ``stamps`` counts boot times that advanced: three of them make a stream, which is proof enough
    to be listened to.  A HEARTBEAT alone is easily said.
    """

    source: Source
    way: Way
    vehicle_type: int
    firmware: int
    heard: float
    beat: float
    armed: bool = False
    tried: float | None = None
    stamps: int = 0
    boot: float | None = None
    boot_at: float = 0.0
    first_boot: float = 0.0
    first_at: float = 0.0
    apart_since: float | None = None
    apart_for: float = 0.0

    @property
    def proven(self) -> bool:
        """Whether it has a stream whose time advances."""
        return self.stamps >= limits.PROOF_STAMPS

    def note_heartbeat(self, message: Message, *, armed: bool, now: float) -> None:
        """Take its HEARTBEAT."""
        self.beat, self.armed = now, armed
        self.vehicle_type, self.firmware = message.type, message.autopilot

    def note_stamp(self, boot: float, now: float) -> None:
        """Take the boot time of a stamped message, s."""
        if self.boot is None or boot > self.boot:
            if self.boot is None:
                self.first_boot, self.first_at = boot, now
            self.stamps += 1
        elif boot < self.boot - limits.CLOCK_AGREES_S:
            self.stamps, self.first_boot, self.first_at = 1, boot, now  # it began anew
            self.apart_since, self.apart_for = None, 0.0
        else:
            return
        self.boot, self.boot_at = boot, now

    def boot_expected(self, now: float) -> float | None:
        """Boot time that its clock should show now, s; a simulator's may run faster than ours."""
        if self.boot is None:
            return None
        elapsed = self.boot_at - self.first_at
        rate = (self.boot - self.first_boot) / elapsed if elapsed > 1.0 else 1.0
        return self.boot + rate * (now - self.boot_at)

    def continues(self, other: Claim, now: float) -> bool:
        """Whether its clock is that of another one, so that both are ways to one vehicle."""
        return self.source == other.source and self._has_the_clock_of(other, now)

    def is_renamed(self, other: Claim, now: float) -> bool:
        """Whether it is another one's autopilot under another system id.

        That takes effect at once: on one way one falls silent, and the other begins, whose clock
        goes on where the first has stopped.
        """
        same_place = self.way == other.way and self.source[1] == other.source[1]
        another = same_place and self.source != other.source and self.proven
        begins = other.heard - self.first_at <= limits.CLOCK_AGREES_S
        return another and begins and self._has_the_clock_of(other, now)

    def note_beside(self, vehicle: Claim, now: float) -> None:
        """It has just told its boot time, and so has, a moment ago, the vehicle of that name."""
        mine, theirs = self.boot_expected(now), vehicle.boot_expected(now)
        if mine is None or theirs is None or now - vehicle.boot_at > limits.CLOCK_AGREES_S:
            return
        if abs(mine - theirs) <= LONGEST_DELAY_S:
            self.apart_since, self.apart_for = None, 0.0
            return
        self.apart_since = now if self.apart_since is None else self.apart_since
        self.apart_for = now - self.apart_since

    @property
    def is_another(self) -> bool:
        """Whether it is another vehicle, whatever it calls itself.

        One vehicle has one boot clock.  Here two have gone on beside each other, further apart than
        a link delays, and for longer than a reboot lasts.
        """
        return self.apart_for > limits.CLOCKS_APART_S

    def _has_the_clock_of(self, other: Claim, now: float) -> bool:
        mine, theirs = self.boot_expected(now), other.boot_expected(now)
        if mine is None or theirs is None:
            return False
        return abs(mine - theirs) <= limits.CLOCK_AGREES_S


class Claims:
    """The claims that are followed: a bounded number, and no address takes the others' places.

    Where all places are taken, the address with the most claims loses one of its own, whatever
    they have proven: it costs nothing to speak as forty autopilots.  Where each has one, those that
    prove nothing give way.  The vehicle's own claim never does.
    """

    def __init__(self) -> None:
        self._claims: dict[tuple[Source, Way], Claim] = {}
        self._pinned: tuple[Source, Way] | None = None

    def __iter__(self) -> Iterator[Claim]:
        return iter(self._claims.values())

    def get(self, source: Source, way: Way) -> Claim | None:
        """The claim of this source on this way, None if it has made none."""
        return self._claims.get((source, way))

    def make(self, source: Source, way: Way, message: Message, now: float) -> Claim | None:
        """A new claim; None while all places are taken by better ones."""
        if len(self._claims) >= limits.CLAIMS_KNOWN and not self._make_room(way, now):
            return None
        claim = Claim(source, way, message.type, message.autopilot, heard=now, beat=now)
        self._claims[source, way] = claim
        return claim

    def _make_room(self, newcomers: Way, now: float) -> bool:
        """Whether a claim has given way to one of ``newcomers``."""
        loose = [key for key in self._claims if key != self._pinned]
        crowd = Counter(way for _, way in loose)
        crowd[newcomers] += 1
        most = max(crowd.values())
        if most > 1:
            loose = [key for key in loose if crowd[key[1]] == most]
        weakest = min(loose, key=lambda key: self._worth(self._claims[key], now))
        claim = self._claims[weakest]
        if most <= 1 and claim.proven and now - claim.heard < limits.PEER_SILENCE_S:
            return False
        del self._claims[weakest]
        return True

    def least_tried(self, now: float) -> Claim | None:
        """Of those that were heard these seconds, the one whose turn is the longest ago."""
        live = (c for c in self._claims.values() if now - c.heard <= limits.TWIN_S)
        return min(live, key=lambda c: -1.0 if c.tried is None else c.tried, default=None)

    def keep(self, pinned: Claim) -> None:
        """The vehicle's own claim is not given up."""
        self._pinned = (pinned.source, pinned.way)
        self._claims[self._pinned] = pinned

    def drop(self, claim: Claim) -> None:
        """It is no more: who makes it again begins anew."""
        self._claims.pop((claim.source, claim.way), None)

    @staticmethod
    def _worth(claim: Claim, now: float) -> tuple[bool, bool, float]:
        silent = now - claim.heard > limits.PEER_SILENCE_S
        return not silent, claim.proven, claim.heard
