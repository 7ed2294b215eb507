"""Where a MAVLink 1 or 2 packet begins and ends, what its header says, whether its checksum holds.

The only place that knows the layout of a packet: the live link, telemetry logs and unpackers ask
here.  ``data`` is anything indexed as bytes, ``at`` the place of the first byte of a packet.

MAVLink 2: magic, payload length, two flag bytes, sequence, system, component, three bytes of
message number, payload, two bytes of checksum, and 13 of signature where a flag says so.
MAVLink 1: magic, payload length, sequence, system, component, message number, payload, checksum.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from mmap import mmap
from struct import Struct
from typing import NamedTuple, TypeAlias

from onboard.mavlink.dialect import mavlink

Bytes: TypeAlias = bytes | bytearray | mmap

MAGIC_V1, MAGIC_V2 = 0xFE, 0xFD
MAGICS = (MAGIC_V1, MAGIC_V2)
SHORTEST = 8
"""A MAVLink 1 packet without payload."""
_START = re.compile(rb"\xfe|\xfd(?:.[\x00\x01]|.?\Z)", re.DOTALL)
"""What may begin a packet: of MAVLink 2 only with flags that are known, or that have not come."""
_SIGNED = 0x01
_HEADER_V1, _HEADER_V2 = 6, 10
_CHECKSUM = 2
_CHECKSUM_BEGINS = 0xFFFF
_SIGNATURE = 13
_EXTRA = {kind: bytes((message.crc_extra,)) for kind, message in mavlink.mavlink_map.items()}
"""The byte that the sender adds to what is summed, by message number."""
_LONGEST = {kind: message.unpacker.size for kind, message in mavlink.mavlink_map.items()}
"""bytes of payload that MAVLink 1 can have, by message number; later fields are MAVLink 2's."""


_checksum: Callable[[bytes, int], int] | None = mavlink.mcrf4xx
"""CRC-16/MCRF4XX in compiled code, where pymavlink has found some."""
_HEAD_V1, _HEAD_V2 = Struct("<xxBBBB").unpack_from, Struct("<xxBxBBBHB").unpack_from


class Header(NamedTuple):
    """What the header of a whole packet says; ``payload`` is the place where the payload begins."""

    message_id: int
    system: int
    component: int
    sequence: int
    signed: bool
    payload: int


def packet_length(data: Bytes, at: int) -> int:
    """Length of the packet that would begin at ``at``; 0 if none can, or fewer than 3 bytes follow.

    A flag that we do not know changes the layout in an unknown way (that is what the first flag
    byte is for), so that nothing can be said of such a packet.
    """
    if at + 3 > len(data):
        return 0
    magic = data[at]
    if magic == MAGIC_V2:
        flags = data[at + 2]
        if flags > _SIGNED:
            return 0
        return data[at + 1] + _HEADER_V2 + _CHECKSUM + (_SIGNATURE if flags else 0)
    return data[at + 1] + _HEADER_V1 + _CHECKSUM if magic == MAGIC_V1 else 0


def message_id(data: Bytes, at: int) -> int:
    """Number of the message; -1 if its bytes have not come."""
    if data[at] == MAGIC_V1:
        return data[at + 5] if at + 5 < len(data) else -1
    number = data[at + 7 : at + _HEADER_V2]
    return int.from_bytes(number, "little") if len(number) == 3 else -1


def header(data: Bytes, at: int) -> Header:
    """The header of a packet that is there as a whole."""
    if data[at] == MAGIC_V1:
        sequence, system, component, kind = _HEAD_V1(data, at)
        return Header(kind, system, component, sequence, False, at + _HEADER_V1)  # noqa: FBT003 - hundreds a second
    flags, sequence, system, component, low, high = _HEAD_V2(data, at)
    signed = flags & _SIGNED == _SIGNED
    return Header(low | high << 16, system, component, sequence, signed, at + _HEADER_V2)


def is_valid(data: Bytes, at: int, kind: int) -> bool:
    """Whether the checksum of a packet that is there as a whole holds, if it is a ``kind``.

    False for a message that the dialect does not have: its checksum cannot be computed.
    """
    extra = _EXTRA.get(kind)
    if extra is None or (data[at] == MAGIC_V1 and data[at + 1] > _LONGEST[kind]):
        return False
    end = at + (_HEADER_V1 if data[at] == MAGIC_V1 else _HEADER_V2) + data[at + 1]
    return checksum(bytes(data[at + 1 : end]) + extra) == data[end] | data[end + 1] << 8


def checksum(summed: bytes) -> int:
    """CRC-16/MCRF4XX, as all packets have it."""
    if _checksum is not None:
        return _checksum(summed, _CHECKSUM_BEGINS)
    return int(mavlink.x25crc(summed).crc)


def next_start(data: Bytes, start: int) -> int:
    """Place of the next byte that may begin a packet, or the end of the data."""
    found = _START.search(data, start)
    return len(data) if found is None else found.start()


def next_valid(data: Bytes, start: int, stop: int | None = None) -> int:
    """Place of the next whole packet with a right checksum that begins before ``stop``.

    ``stop`` (the end of the data, if not given) if there is none.
    """
    stop = len(data) if stop is None else stop
    at = next_start(data, start)
    while at < stop:
        length = packet_length(data, at)
        if length and at + length <= len(data) and is_valid(data, at, message_id(data, at)):
            return at
        at = next_start(data, at + 1)
    return stop


class NextValid:
    """Where the next valid packet begins, for starts that only grow: no place is checked twice.

    ``data`` must not change while this is in use.
    """

    def __init__(self, data: Bytes) -> None:
        self._data = data
        self._found = -1

    def after(self, start: int) -> int:
        """Place of the first whole packet with a right checksum from ``start`` on, or the end."""
        if self._found < start:
            self._found = next_valid(self._data, start)
        return self._found
