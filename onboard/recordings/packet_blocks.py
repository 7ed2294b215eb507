"""Packets of one autopilot to blocks of samples: what is many in columns, the rest one by one.

What comes out are the samples that :class:`~onboard.mavlink.decode.Decoder` makes of the same
packets.  It makes those that are not in columns, with its clock put forward to where each packet
stands; where the clock would do anything but go on, all are left to it.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import NO_ATTITUDE, Block, ImuColumns
from onboard.core.inputs.samples import Sample
from onboard.mavlink.bootclock import STAMPED
from onboard.mavlink.column_readings import (
    ATTITUDE,
    IN_COLUMNS,
    attitude_columns,
    boot_times,
    imu_columns,
)
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import message_ids
from onboard.recordings.packet_columns import Headers, Integers, Octets, headers, records
from onboard.recordings.packets import Unpacker

Floats: TypeAlias = NDArray[np.float64]

STAMPS = message_ids(STAMPED)


class PacketBlocks:
    """Makes blocks of the packets of a file.

    Args:
        data: (length,) the bytes of the file.
        decoder: with a clock of its own, which is told of everything here.
        unpack: for what does not go in columns.
    """

    def __init__(self, data: Octets, decoder: Decoder, unpack: Unpacker) -> None:
        self._data, self._decoder, self._unpack = data, decoder, unpack

    def __call__(self, at: Integers) -> Block | None:
        """The samples of packets at places (n,), all of the autopilot.

        None, and nothing has been done, if they are to be decoded one by one.
        """
        if self._decoder.source is None:
            return None  # nothing is taken before the first heartbeat
        if self._decoder.tells_views:
            return None  # which attitudes are used depends on the others
        head = headers(self._data, at)
        columns = _Columns(len(at))
        for kind in np.unique(head.kind).tolist():
            if kind in STAMPS and not columns.add(kind, self._data, head):
                return None
        stamps = columns.stamps[np.isfinite(columns.stamps)]
        if not self._decoder.clock.only_advances(stamps):
            return None
        self._decoder.refused.update(Counter(self._decoder.refused) + columns.left_out)
        return self._block(at, head, columns)

    def _block(self, at: Integers, head: Headers, columns: _Columns) -> Block:
        """A block, with what is not in columns decoded."""
        alone = np.flatnonzero(~np.isin(head.kind, list(IN_COLUMNS)))
        # The stamps of what is decoded one by one are told by the decoder itself.
        stamps = columns.stamps.copy()
        stamps[alone] = -np.inf
        newest = np.maximum.accumulate(stamps)
        clock, decode = self._decoder.clock, self._decoder.decode
        others: list[Sample] = []
        places: list[int] = []
        messages = self._unpack(self._data, at[alone])
        heard = zip(messages, alone.tolist(), newest[alone].tolist(), strict=True)
        for message, place, t in heard:
            if t > -math.inf:
                clock.advance(t)
            if message is not None:
                samples = decode(message)
                others += samples
                places += [place] * len(samples)
        if newest[-1] > -math.inf:
            clock.advance(newest.item(-1))
        imus = sorted(columns.imus, key=lambda c: c.places.item(0))
        return Block(tuple(imus), columns.attitude, others, places)


class _Columns:
    """The columns of a block: boot times ``stamps`` (n,), s, of all stamped packets, else -inf."""

    def __init__(self, n: int) -> None:
        self.stamps: Floats = np.full(n, -np.inf)
        self.imus: list[ImuColumns] = []
        self.attitude = NO_ATTITUDE
        self.left_out: Counter[str] = Counter()

    def add(self, kind: int, data: Octets, head: Headers) -> bool:
        """Take the packets of a stamped kind; False if one is to be looked at by itself."""
        places = np.flatnonzero(head.kind == kind)
        its = records(kind, data, head.of(places))
        t = boot_times(its)
        if t is None:
            return False
        self.stamps[places] = t
        if kind == ATTITUDE:
            attitude = attitude_columns(its, places, t)
            if attitude is None:
                return False
            self.attitude = attitude
        elif kind in IN_COLUMNS:
            found = imu_columns(kind, its, places, t)
            if found is None:
                return False
            self.imus += found[0]
            self.left_out += found[1]
        return True
