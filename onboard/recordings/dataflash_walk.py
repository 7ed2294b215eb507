"""The walk over a DataFlash log from record to record; after damage it looks for the next one.

A record says by its type how long it is, and so where the next one begins.  Where nothing is
damaged and no type is defined, the walk takes long strides: places that look like a header are
found by numpy, and those that follow one another are records.  Everything else is walked record by
record, so that the strides change nothing but the time.
"""

from __future__ import annotations

from array import array
from mmap import mmap
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.recordings.dataflash_formats import HEADER_LENGTH, Format, parse_format
from onboard.recordings.pace import Pace, chain

Bytes: TypeAlias = bytes | mmap
Integers: TypeAlias = NDArray[np.int64]

MAGIC = b"\xa3\x95"
FMT_TYPE = 0x80
FMT_LENGTH = 89
"""Type and bytes, header included, of the record that describes the others [data sheet:
LogStructure of ArduPilot]."""
PADDING = b"\x00\xff"
MOST_FORMATS = 4096
"""Layouts of wanted records in one file: a log has 20, and as many for each that was joined.  More
is no log, and each costs memory [bound]."""


class Stride(NamedTuple):
    """Whole records one after the other: their places and types, and where the last one ends."""

    offsets: Integers
    kinds: NDArray[np.uint8]
    end: int


class Walk:
    """One walk over the bytes; the state is what the walk has learnt so far.

    ``skipped_bytes`` stand between records, ``cut_off_bytes`` after the last whole one: with the
    lengths of all records they add up to the length of the log, but for the unused end of a page.
    """

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
        self.cut_off_bytes = 0
        self._bytes = np.frombuffer(data, np.uint8)
        self._tables: tuple[Integers, Integers] | None = None

    def run(self) -> None:
        """Find the records; never raises on damage, counts it instead."""
        at = previous = 0
        end, pace = len(self.data), Pace()
        while at + HEADER_LENGTH <= end:
            if pace.strides(at):
                stop = min(at + pace.length, end)
                stride = self._stride(at, stop)
                if len(stride.offsets):
                    self._keep(stride)
                    previous, at = int(stride.offsets[-1]), stride.end
                whole = len(stride.offsets) > 0 and at >= stop - HEADER_LENGTH
                pace.took(at, whole=whole)
                if whole:
                    continue
            length = self._record(at, end)
            if length:
                previous = at
                at += length
                continue
            found = self._resume(previous + HEADER_LENGTH if self.records else at, end)
            torn = found < at
            self._count_damage(previous if torn else at, found, end)
            if torn:
                # The record before was torn: the next one starts inside it.
                self.records -= 1
                if self.offsets and self.offsets[-1] == previous:
                    self.offsets.pop()
                    self.slots.pop()
            at = found
        if at < end:
            self._count_damage(at, end, end)

    def _stride(self, at: int, stop: int) -> Stride:
        """Records from ``at`` on that begin before ``stop``, up to an FMT record or to damage."""
        block = self._bytes[at:stop]
        starts = np.flatnonzero(block[:-2] == MAGIC[0])
        starts = starts[block[starts + 1] == MAGIC[1]]
        kinds = block[starts + 2]
        lengths = self._by_kind()[0][kinds]
        following = starts + lengths
        whole = (lengths > 0) & (kinds != FMT_TYPE) & (following <= len(self.data) - at)
        if not len(starts) or starts[0] != 0 or not whole[0]:
            return Stride(starts[:0], kinds[:0], at)
        starts, following, kinds = starts[whole], following[whole], kinds[whole]
        taken = chain(starts, following)
        return Stride(at + starts[taken], kinds[taken], at + int(following[taken[-1]]))

    def _by_kind(self) -> tuple[Integers, Integers]:
        """Length and slot of each type (256,), as learnt until now."""
        if self._tables is None:
            self._tables = np.array(self.lengths, np.int64), np.array(self.slot_of, np.int64)
        return self._tables

    def _keep(self, stride: Stride) -> None:
        """Take the wanted records of a stride."""
        slots = self._by_kind()[1][stride.kinds]
        wanted = slots >= 0
        self.offsets.frombytes(stride.offsets[wanted].astype(np.int64).tobytes())
        self.slots.frombytes(slots[wanted].astype(np.uint16).tobytes())
        self.records += len(stride.offsets)

    def _record(self, at: int, end: int) -> int:
        """Take one record; its length, 0 if there is none."""
        magic_0, magic_1, kind = self.data[at : at + HEADER_LENGTH]
        length = self.lengths[kind]
        if magic_0 != MAGIC[0] or magic_1 != MAGIC[1] or not length or at + length > end:
            return 0
        slot = self.slot_of[kind]
        if slot >= 0:
            self.offsets.append(at)
            self.slots.append(slot)
        elif kind == FMT_TYPE:
            self._learn(bytes(self.data[at : at + length]))
        self.records += 1
        return length

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
        self._tables = None
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
            self.cut_off_bytes += found - at
        else:
            self.damaged_places += 1
            self.skipped_bytes += found - at
