"""Where the records of a DataFlash log are, and what their bytes mean.

A log is a sequence of records ``A3 95 type payload``; FMT records (type 128) give the length
and the fields of every other type.  The scan keeps the place of each record that is wanted
(nine bytes each), so that a log of any size is afterwards read in blocks.  pymavlink's
``DFReader`` has such an index too, but it prints on damage, recurses over it, and gives up on a
log that has one format letter it does not know.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from mmap import mmap

import numpy as np
from numpy.typing import NDArray

Bytes = bytes | mmap
Records = NDArray[np.void]

MAGIC = b"\xa3\x95"
FMT_TYPE = 0x80
FMT_LENGTH = 89
HEADER_LENGTH = 3
PADDING = b"\x00\xff"

FIELD_TYPES: dict[str, tuple[str, float]] = {
    "a": ("(32,)<i2", 1.0),
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "g": ("<f2", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "n": ("S4", 1.0),
    "N": ("S16", 1.0),
    "Z": ("S64", 1.0),
    "c": ("<i2", 100.0),
    "C": ("<u2", 100.0),
    "e": ("<i4", 100.0),
    "E": ("<u4", 100.0),
    "L": ("<i4", 1e7),
    "M": ("u1", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
}
"""Format letter to numpy type and the divisor that makes the field a physical number."""
LARGEST = 2.0**53
"""Whole numbers below it are exact as floating-point ones."""
NOT_NUMBERS = "anNZ"
MOST_FORMATS = 4096
"""Layouts of wanted records in one file: a log has 20, and as many for each that was joined."""


@dataclass(frozen=True, slots=True)
class Format:
    """Layout of one type of record: ``length`` with header; ``dtype`` None if not readable."""

    kind: int
    name: str
    length: int
    letters: str
    columns: tuple[str, ...]
    dtype: np.dtype[np.void] | None

    def has(self, *columns: str) -> bool:
        """Whether all of these fields are there."""
        return all(column in self.columns for column in columns)

    def letter(self, column: str) -> str:
        """The format letter of a field."""
        return self.letters[self.columns.index(column)]

    def numbers(self, records: Records, column: str) -> NDArray[np.float64]:
        """(n,) a numeric field in the unit that its format letter implies; NaN for what is text."""
        letter = self.letter(column)
        if letter in NOT_NUMBERS:
            return np.full(len(records), np.nan)
        divisor = FIELD_TYPES[letter][1]
        with np.errstate(invalid="ignore"):  # a signalling NaN, by a flipped bit
            values = records[column].astype(np.float64)
        return values if divisor == 1.0 else values / divisor

    def integers(self, records: Records, column: str, default: int = 0) -> list[int]:
        """(n,) a whole number; a default where it is none."""
        if self.letter(column) in NOT_NUMBERS:
            return [default] * len(records)
        values = records[column]
        if values.dtype.kind == "f":
            with np.errstate(invalid="ignore"):
                whole = np.abs(values.astype(np.float64)) < LARGEST
            values = np.where(whole, values, default)
        return [int(value) for value in values]


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", errors="replace")


def parse_format(record: bytes) -> Format | None:
    """The format that an FMT record (89 bytes) defines; None if the record is damaged."""
    kind, length, name, letters_raw, columns_raw = struct.unpack(
        "<BB4s16s64s", record[HEADER_LENGTH:]
    )
    letters, columns = _text(letters_raw), tuple(filter(None, _text(columns_raw).split(",")))
    if length < HEADER_LENGTH:
        return None
    if any(letter not in FIELD_TYPES for letter in letters):
        return Format(kind, _text(name), length, letters, columns, None)
    if len(columns) != len(letters) or len(set(columns)) != len(columns):
        return Format(kind, _text(name), length, letters, columns, None)
    sizes = [np.dtype(FIELD_TYPES[letter][0]).itemsize for letter in letters]
    if HEADER_LENGTH + sum(sizes) != length:
        return Format(kind, _text(name), length, letters, columns, None)
    dtype = np.dtype(
        {
            "names": list(columns),
            "formats": [FIELD_TYPES[letter][0] for letter in letters],
            "offsets": [HEADER_LENGTH + sum(sizes[:k]) for k in range(len(sizes))],
            "itemsize": length,
        }
    )
    return Format(kind, _text(name), length, letters, columns, dtype)


@dataclass(frozen=True, slots=True)
class DataflashIndex:
    """Places of the wanted records, in the order of the file.

    ``slots[i]`` numbers the format (in ``formats``) of the record at ``offsets[i]``: a type that
    is defined anew, as in logs that were joined, gets a slot of its own.
    """

    data: Bytes
    formats: tuple[Format, ...]
    slots: NDArray[np.uint16]
    offsets: NDArray[np.int64]
    records: int
    damaged_places: int
    skipped_bytes: int
    cut_off: bool

    def counts(self) -> dict[str, int]:
        """Number of wanted records by name."""
        counts: dict[str, int] = {}
        for slot, n in zip(*np.unique(self.slots, return_counts=True), strict=True):
            name = self.formats[slot].name
            counts[name] = counts.get(name, 0) + int(n)
        return counts

    def gather(self, slot: int, offsets: NDArray[np.int64]) -> Records:
        """(n,) structured array of the records of one format at ``offsets``."""
        form = self.formats[slot]
        if form.dtype is None:
            raise ValueError(f"{form.name} records are not readable")
        window = np.lib.stride_tricks.sliding_window_view(
            np.frombuffer(self.data, np.uint8), form.length
        )
        records: Records = window[offsets].view(form.dtype)[:, 0]
        return records

    def all_of(self, name: str, block: int = 65536) -> Iterator[tuple[Format, Records]]:
        """All records of one name, in blocks."""
        for slot, form in enumerate(self.formats):
            if form.name == name:
                places = self.offsets[self.slots == slot]
                for start in range(0, len(places), block):
                    yield form, self.gather(slot, places[start : start + block])


class _Scan:
    """One walk over the bytes; the state is what the walk has learnt so far."""

    def __init__(self, data: Bytes, wanted: frozenset[str]) -> None:
        self.data = data
        self.wanted = wanted
        self.lengths = [0] * 256
        self.lengths[FMT_TYPE] = FMT_LENGTH
        self.slot_of = [-1] * 256
        self.formats: dict[Format, int] = {}
        self.offsets = array("q")
        self.slots = array("H")
        self.records = 0
        self.damaged_places = 0
        self.skipped_bytes = 0
        self.cut_off = False

    def run(self) -> None:
        data, lengths, slot_of = self.data, self.lengths, self.slot_of
        add_offset, add_slot = self.offsets.append, self.slots.append
        end = len(data)
        at = previous = records = 0
        while at + HEADER_LENGTH <= end:
            magic_0, magic_1, kind = data[at : at + HEADER_LENGTH]
            length = lengths[kind]
            if magic_0 == 0xA3 and magic_1 == 0x95 and length and at + length <= end:
                slot = slot_of[kind]
                if slot >= 0:
                    add_offset(at)
                    add_slot(slot)
                elif kind == FMT_TYPE:
                    self._learn(bytes(data[at : at + length]))
                previous = at
                at += length
                records += 1
                continue
            found = self._resume(previous + HEADER_LENGTH if records else at, end)
            self._count_damage(at, found, end)
            if found < at:
                # The record before was torn: the next one starts inside it.
                records -= 1
                if self.offsets and self.offsets[-1] == previous:
                    self.offsets.pop()
                    self.slots.pop()
            at = found
        self.records = records

    def _learn(self, record: bytes) -> None:
        if record[HEADER_LENGTH] == FMT_TYPE:
            return  # the description of FMT itself
        form = parse_format(record)
        if form is None:
            self.damaged_places += 1
            return
        known = self.slot_of[form.kind]
        if known >= 0 and self.formats.get(form) == known:
            return
        if known >= 0 and form.dtype is None:
            self.damaged_places += 1  # a readable type is not given up for a damaged FMT
            return
        self.lengths[form.kind] = form.length
        wanted = form.name in self.wanted and form.dtype is not None
        if wanted and (form in self.formats or len(self.formats) < MOST_FORMATS):
            self.slot_of[form.kind] = self.formats.setdefault(form, len(self.formats))
        else:
            self.slot_of[form.kind] = -1

    def _resume(self, start: int, end: int) -> int:
        """Next place where a record of a known type begins and another one follows it."""
        data, lengths = self.data, self.lengths
        at = data.find(MAGIC, start)
        while at >= 0:
            length = lengths[data[at + 2]] if at + 2 < end else 0
            after = at + length
            if length and (
                after == end
                or (
                    after + 2 < end
                    and data[after : after + 2] == MAGIC
                    and lengths[data[after + 2]]
                )
            ):
                return at
            at = data.find(MAGIC, at + 1)
        return end

    def _count_damage(self, at: int, found: int, end: int) -> None:
        if found == end:
            tail = bytes(self.data[at : min(end, at + 65536)])
            if not tail.strip(PADDING):
                return  # the unused end of a flash page
            self.cut_off = True
        else:
            self.damaged_places += 1
        self.skipped_bytes += max(0, found - at)


def index_dataflash(data: Bytes, wanted: frozenset[str]) -> DataflashIndex:
    """Find the records of the ``wanted`` names; never raises on damage, counts it instead."""
    scan = _Scan(data, wanted)
    scan.run()
    return DataflashIndex(
        data=data,
        formats=tuple(scan.formats),
        slots=np.frombuffer(scan.slots, np.uint16),
        offsets=np.frombuffer(scan.offsets, np.int64),
        records=scan.records,
        damaged_places=scan.damaged_places,
        skipped_bytes=scan.skipped_bytes,
        cut_off=scan.cut_off,
    )
