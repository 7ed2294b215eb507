"""Where the packets of a .tlog are: an 8-byte time of arrival before each, MAVLink 1 or 2.

Packets are found by length; those that are wanted are also checked by their sum, others by what
follows them.  Damage costs the packets that it hit and no others.  Where one packet follows the
other the walk takes long strides by numpy; everything else is walked packet by packet, so that the
strides change nothing but the time.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from mmap import mmap
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.mavlink.framing import MAGICS, is_valid, message_id, next_valid, packet_length
from onboard.recordings.pace import Pace, chain
from onboard.recordings.packet_columns import (
    LONGEST_PACKET,
    STAMP_LENGTH,
    Integers,
    are_valid,
    candidates,
    headers,
    lengths,
    stamps,
)

Bytes: TypeAlias = bytes | mmap

LONGEST_SILENCE_US = 86_400_000_000


@dataclass(frozen=True, slots=True)
class TlogIndex:
    """Places of the wanted packets in the order of the file, and what was damaged."""

    data: Bytes
    offsets: Integers
    packets: int
    damaged_places: int
    skipped_bytes: int
    cut_off_bytes: int


def index_tlog(data: Bytes, wanted: frozenset[int]) -> TlogIndex:
    """Find the packets of some message numbers; never raises on damage, counts it instead."""
    walk = _Walk(data, wanted)
    walk.run()
    return TlogIndex(
        data=data,
        offsets=np.frombuffer(walk.offsets, np.int64),
        packets=walk.packets,
        damaged_places=walk.damaged_places,
        skipped_bytes=walk.skipped_bytes,
        cut_off_bytes=walk.cut_off_bytes,
    )


class _Walk:
    """One walk over the file; places are those of packets, not of the times before them.

    With the lengths of all packets and of the times before them, ``skipped_bytes`` and, after the
    last packet, ``cut_off_bytes`` add up to the length of the file.
    """

    def __init__(self, data: Bytes, wanted: frozenset[int]) -> None:
        self.data = data
        self.wanted = wanted
        self.offsets = array("q")
        self.packets = 0
        self.damaged_places = 0
        self.skipped_bytes = 0
        self.cut_off_bytes = 0
        self._bytes = np.frombuffer(data, np.uint8)
        self._wanted = np.array(sorted(wanted), np.int64)

    def run(self) -> None:
        data, end = self.data, len(self.data)
        pace = Pace()
        at = STAMP_LENGTH
        while at < end:
            if pace.strides(at):
                stop = min(at + pace.length, end - LONGEST_PACKET - STAMP_LENGTH)
                following = self._stride(at, stop)
                pace.took(following, whole=following >= stop and following > at)
                if following > at:
                    at = following
                    continue
            length = packet_length(data, at)
            kind = message_id(data, at) if length else -1
            if length and at + length <= end and self._is_packet(at, length, kind):
                self.packets += 1
                if kind in self.wanted:
                    self.offsets.append(at)
                at += length + STAMP_LENGTH
                continue
            found = next_valid(data, at + 1)
            if found >= end:
                break
            self.damaged_places += 1
            self.skipped_bytes += found - at
            at = found
        # Of a packet that is not there as a whole, its time of arrival is of no use.
        self.cut_off_bytes = max(0, end - (at - STAMP_LENGTH))

    def _is_packet(self, at: int, length: int, kind: int) -> bool:
        """Whether the checksum holds, or, if nobody asks, another packet follows."""
        following = at + length + STAMP_LENGTH
        return is_valid(self.data, at, kind) or (
            kind not in self.wanted and _chained(self.data, at, following, len(self.data))
        )

    def _stride(self, at: int, stop: int) -> int:
        """Take packets from ``at`` on that begin before ``stop``; the place after the last one."""
        data = self._bytes
        starts = candidates(data, at, stop)
        following = starts + lengths(data, starts) + STAMP_LENGTH
        # Behind a packet stands another one that came about then: what stands by chance inside a
        # packet has none behind it.
        magic = data[following]
        lead = (magic == MAGICS[0]) | (magic == MAGICS[1])
        starts, following = starts[lead], following[lead]
        near = _between(stamps(data, starts), stamps(data, following)) < LONGEST_SILENCE_US
        starts, following = starts[near], following[near]
        if not len(starts) or starts[0] != at:
            return at
        taken = chain(starts, following)
        starts, following = starts[taken], following[taken]
        head = headers(data, starts)
        asked = np.flatnonzero(np.isin(head.kind, self._wanted))
        bad = asked[~are_valid(data, starts[asked], head.of(asked))]
        if len(bad):
            starts, following = starts[: bad[0]], following[: bad[0]]
            asked = asked[asked < bad[0]]
        self.packets += len(starts)
        self.offsets.frombytes(starts[asked].tobytes())
        return int(following[-1]) if len(starts) else at


def _between(a: NDArray[np.uint64], b: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Distances of unsigned numbers."""
    distance: NDArray[np.uint64] = np.maximum(a, b) - np.minimum(a, b)
    return distance


def _chained(data: Bytes, at: int, following: int, end: int) -> bool:
    """Whether a packet that we cannot check is followed by another that arrived about then."""
    if following >= end or data[following] not in MAGICS:
        return following == end + STAMP_LENGTH
    here, there = (
        int.from_bytes(data[place - STAMP_LENGTH : place], "big") for place in (at, following)
    )
    return abs(there - here) < LONGEST_SILENCE_US
