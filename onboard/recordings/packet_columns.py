"""Many MAVLink packets of a file at once: headers, checksums and payloads as columns.

What a packet looks like is said in :mod:`onboard.mavlink.framing`, whose words for one packet are
said here for many; the tests hold one against the other.  ``data`` (length,) are the bytes of the
file, ``at`` (n,) places where packets begin that are there as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.framing import MAGIC_V1, MAGIC_V2

Octets: TypeAlias = NDArray[np.uint8]
Integers: TypeAlias = NDArray[np.int64]

STAMP_LENGTH = 8
"""bytes before each packet: microseconds since 1970 [data sheet: the .tlog format]."""
HEADER_V1, HEADER_V2 = 6, 10
CHECKSUM, SIGNATURE = 2, 13
LONGEST_PACKET = 280
"""bytes: a header, 255 of payload, checksum and signature [data sheet: MAVLink 2]."""
WIDTHS = (32, 64, 128, LONGEST_PACKET)
"""Packets are summed in groups of about one length [cost]."""
POLYNOMIAL = 0x8408
"""Of CRC-16/MCRF4XX, the least bit first."""
LETTERS = {"c": "S1", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4",
           "q": "<i8", "Q": "<u8", "f": "<f4", "d": "<f8"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Headers:
    """What the headers say, (n,) each; ``length`` is that of the packet."""

    kind: Integers
    system: Integers
    component: Integers
    payload: Integers
    payload_length: Integers
    length: Integers

    def of(self, rows: Integers) -> Headers:
        """Some of them."""
        return Headers(
            self.kind[rows],
            self.system[rows],
            self.component[rows],
            self.payload[rows],
            self.payload_length[rows],
            self.length[rows],
        )


def candidates(data: Octets, start: int, stop: int) -> Integers:
    """Places from ``start`` on and before ``stop`` where a packet may begin."""
    block = data[start : max(start, min(stop, len(data) - 2))]
    at: Integers = start + np.flatnonzero((block == MAGIC_V1) | (block == MAGIC_V2))
    possible: Integers = at[(data[at] == MAGIC_V1) | (data[at + 2] <= 1)]
    return possible


def lengths(data: Octets, at: Integers) -> Integers:
    """Lengths of the packets that begin there, if any do."""
    old = data[at] == MAGIC_V1
    around = np.where(old, HEADER_V1, HEADER_V2 + SIGNATURE * data[at + 2].astype(np.int64))
    found: Integers = data[at + 1].astype(np.int64) + around + CHECKSUM
    return found


def headers(data: Octets, at: Integers) -> Headers:
    """The headers of whole packets."""
    old = data[at] == MAGIC_V1
    low = data[at + np.where(old, 5, 7)].astype(np.int64)
    high = data[at + np.where(old, 5, 8)].astype(np.int64) << 8
    top = data[at + np.where(old, 5, 9)].astype(np.int64) << 16
    return Headers(
        kind=np.where(old, low, low | high | top),
        system=data[at + np.where(old, 3, 5)].astype(np.int64),
        component=data[at + np.where(old, 4, 6)].astype(np.int64),
        payload=at + np.where(old, HEADER_V1, HEADER_V2),
        payload_length=data[at + 1].astype(np.int64),
        length=lengths(data, at),
    )


def stamps(data: Octets, at: Integers) -> NDArray[np.uint64]:
    """Times of arrival, us, that stand before the packets."""
    words = np.ndarray((len(data) - STAMP_LENGTH + 1,), ">u8", data, strides=(1,))
    found: NDArray[np.uint64] = words[at - STAMP_LENGTH].astype(np.uint64)
    return found


def bytes_at(data: Octets, at: Integers, width: int) -> Octets:
    """(n, width) bytes from each place on; zeros after the end of the data."""
    inside = at + width <= len(data)
    if len(data) < width:
        data, inside = np.append(data, np.zeros(width, np.uint8)), inside | True
    everywhere = np.ndarray((len(data) - width + 1,), f"V{width}", data, strides=(1,))
    rows: Octets = everywhere[np.where(inside, at, 0)].view(np.uint8).reshape(-1, width)
    for row in np.flatnonzero(~inside).tolist():
        rest = data[at[row] :]
        rows[row, : len(rest)], rows[row, len(rest) :] = rest, 0
    return rows


def payloads(data: Octets, head: Headers, width: int) -> Octets:
    """(n, width) payloads, with the zeros at their ends that the sender left out."""
    rows = bytes_at(data, head.payload, width)
    short = np.flatnonzero(head.payload_length < width)
    rows[short] *= np.arange(width) < head.payload_length[short, None]
    return rows


def are_valid(data: Octets, at: Integers, head: Headers) -> NDArray[np.bool_]:
    """Whether the checksums hold, (n,); False for messages that the dialect does not have."""
    known = np.zeros(len(at), bool)
    extra = np.zeros(len(at), np.uint16)
    for kind in np.unique(head.kind).tolist():
        message = mavlink.mavlink_map.get(kind)
        if message is None:
            continue
        its = head.kind == kind
        extra[its] = message.crc_extra
        # Of the fields, MAVLink 1 has the first ones only.
        known |= its & ((data[at] == MAGIC_V2) | (head.payload_length <= message.unpacker.size))
    summed = head.payload + head.payload_length - at - 1
    crc = np.zeros(len(at), np.uint16)
    narrower = 0
    for width in WIDTHS:
        group = np.flatnonzero((summed > narrower) & (summed <= width))
        narrower = width
        if len(group):
            group = group[np.argsort(-summed[group], kind="stable")]
            crc[group] = _sums(bytes_at(data, at[group] + 1, width), summed[group])
    crc = _with_byte(crc, extra)
    end = head.payload + head.payload_length
    told = data[end] | data[end + 1].astype(np.uint16) << 8
    valid: NDArray[np.bool_] = known & (crc == told)
    return valid


def _sums(rows: Octets, count: Integers) -> NDArray[np.uint16]:
    """Checksums of the first ``count`` (n,) bytes of rows, which are sorted: the most first."""
    words = rows.view("<u2")
    # The register is as wide as two bytes, which therefore change it by one table together.
    by_two = _tables()[1]
    crc = np.full(len(rows), 0xFFFF, np.uint16)
    pairs = 2 * np.arange(1, int(count[0]) // 2 + 1)
    for k, whole in enumerate(np.searchsorted(-count, -pairs, side="right").tolist()):
        crc[:whole] = by_two[crc[:whole] ^ words[:whole, k]]
    odd = np.flatnonzero(count % 2)
    crc[odd] = _with_byte(crc[odd], rows[odd, count[odd] - 1].astype(np.uint16))
    return crc


def _with_byte(crc: NDArray[np.uint16], byte: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Checksums with one byte more."""
    out: NDArray[np.uint16] = crc >> 8 ^ _tables()[0][(crc ^ byte) & 0xFF]
    return out


@cache
def _tables() -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """What one byte (256,) and two bytes (65536,) make of a register that was zero."""
    one = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = np.where(one & 1, one >> 1 ^ POLYNOMIAL, one >> 1).astype(np.uint16)
    words = np.arange(65536, dtype=np.uint16)
    first = one[words & 0xFF]
    return one, first >> 8 ^ one[(first ^ words >> 8) & 0xFF]


@cache
def layout_of(kind: int) -> np.dtype[np.void]:
    """Type of the payload of a message by its number."""
    return layout(mavlink.mavlink_map[kind])


def records(kind: int, data: Octets, head: Headers) -> NDArray[np.void]:
    """(n,) payloads of messages of one kind, with fields by their names."""
    form = layout_of(kind)
    # The sender leaves out zeros at the end, and may know more fields than we do.
    return payloads(data, head, form.itemsize).view(form)[:, 0]


def layout(message: Message) -> np.dtype[np.void]:
    """Type of a message's payload, of its class in the dialect: text where it has characters."""
    letters = message.native_format.decode("ascii").lstrip("<")
    fields = []
    for name, letter, count in zip(
        message.ordered_fieldnames, letters, message.array_lengths, strict=True
    ):
        if letter == "c":
            fields.append((name, f"S{max(count, 1)}"))
        else:
            fields.append((name, f"({count},){LETTERS[letter]}" if count else LETTERS[letter]))
    return np.dtype(fields)
