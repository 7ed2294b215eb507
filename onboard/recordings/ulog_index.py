"""Where the records of a ULog are, and what their bytes mean.

A ULog is a header of 16 bytes and messages ``length (2) kind (1) body``; F messages give the fields
of a type, A messages the number of a topic, D messages its records.  The walk goes over the file
once and keeps the place of each record that is wanted; types are never unfolded, only measured, so
that time and memory are bounded by the length of the file, whatever is in it.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from mmap import mmap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.errors import RecordingError
from onboard.recordings.pace import Pace, chain
from onboard.recordings.ulog_messages import LONGEST_KEY, PASSED_BY, is_name
from onboard.recordings.ulog_types import Layout, Types

Bytes = bytes | mmap
Records = NDArray[np.void]

MAGIC = b"ULog\x01\x12\x35"
HEADER_LENGTH = 16
KINDS = frozenset(b"BFIMPQARDLCSO")
LONGEST_UNKNOWN = 10000
"""bytes; a message of a kind that nobody knows and that is longer is damage."""
MOST_IN_A_ROW = 4
"""Messages of kinds that nobody knows, one after the other: in a row of more, noise is likelier to
look like one that is known at its end [bound]."""
MOST_PARAMETERS = 20_000
"""PX4 has some 2000."""
UNFOLDED = 32
"""Elements; longer arrays are of bytes to be passed on, and are not made columns."""
_HEAD = struct.Struct("<HB")


@dataclass(slots=True)
class Topic:
    """One instance of a topic: its layout, and where its records are."""

    layout: Layout
    offsets: array[int] = field(default_factory=lambda: array("q"))

    def records(self, data: Bytes) -> Records:
        """(n,) structured array of all its records."""
        if not self.offsets:
            return np.zeros(0, self.layout.dtype)
        size = self.layout.dtype.itemsize
        # At every byte a record might begin: overlapping ones, of which some are taken.
        everywhere: Records = np.ndarray((len(data) - size + 1,), f"V{size}", data, strides=(1,))
        return everywhere[np.frombuffer(self.offsets, np.int64)].view(self.layout.dtype)


@dataclass(slots=True)
class UlogIndex:
    """Wanted topics by name and instance; parameters with the time (us) of their change."""

    topics: dict[tuple[str, int], Topic] = field(default_factory=dict)
    initial: dict[str, float] = field(default_factory=dict)
    changed: list[tuple[int, str, float]] = field(default_factory=list)
    damaged_places: int = 0
    skipped_bytes: int = 0
    cut_off_bytes: int = 0
    dropouts: int = 0
    dropped_ms: int = 0


class _Walk:
    """One walk over the file; the state is what it has learnt so far."""

    def __init__(self, data: Bytes, wanted: frozenset[str]) -> None:
        self.data = data
        self.wanted = wanted
        self.index = UlogIndex()
        self._types = Types()
        self._layouts: dict[str, Layout | None] = {}
        self._topic_of: dict[int, Topic] = {}
        self._others: set[int] = set()
        # Sizes (with the number) that records may have, by the number of the topic; 0 to none.
        self._least = np.full(65536, 65535, np.uint16)
        self._most = np.zeros(65536, np.uint16)
        self._bytes = np.frombuffer(data, np.uint8)
        self._words = np.ndarray((len(data) - 1,), "<u2", data, strides=(1,))
        self._stamps = np.ndarray((len(data) - 7,), "<u8", data, strides=(1,))
        self._defining = True
        self._time = 0
        self._jumps: list[int] = []
        self._wasted = 0
        self._handlers: dict[int, Callable[[int, int], bool]] = {
            ord("D"): self._record,
            ord("F"): self._type,
            ord("A"): self._subscription,
            ord("P"): self._parameter,
            ord("O"): self._dropout,
            ord("B"): self._flags,
        }
        passed = {kind: partial(check, data) for kind, check in PASSED_BY.items()}
        self._handlers |= passed

    def run(self) -> None:
        data, end = self.data, len(self.data)
        at = HEADER_LENGTH
        whole = True
        index, pace = self.index, Pace()
        while at + _HEAD.size <= end:
            if whole and pace.strides(at):
                last = self._jumps[0] if self._jumps else end
                stop = min(at + pace.length, last)
                following = self._stride(at, stop, last)
                pace.took(following, whole=following >= stop - _HEAD.size and following > at)
                if following > at:
                    at, whole = following, True
                    continue
            size, kind = _HEAD.unpack_from(data, at)
            body, stop = at + _HEAD.size, at + _HEAD.size + size
            if self._jumps and stop > self._jumps[0]:
                at = max(at, self._jumps.pop(0))
                continue
            if kind in KINDS and stop <= end and (whole or self._sure(body, kind, stop)):
                following, good = stop, self._handlers[kind](body, stop)
            else:
                following, good = stop, whole and kind not in KINDS and self._is_new(at)
            if not good and whole and stop > end and self._begins(at):
                break
            if not good:
                following = self._resume(at, kind, stop)
                index.damaged_places += whole
                index.skipped_bytes += following - at
            at, whole = following, good
        index.cut_off_bytes += max(0, end - at)

    def _stride(self, at: int, stop: int, last: int) -> int:
        """Take records that begin before ``stop`` and end by ``last``; where it goes on."""
        kinds = self._bytes[at + 2 : min(stop, last - 2)]
        starts = at + np.flatnonzero(kinds == ord("D"))
        numbers, sizes = self._words[starts + _HEAD.size], self._words[starts]
        known = (self._least[numbers] <= sizes) & (sizes <= self._most[numbers])
        following = starts + _HEAD.size + sizes
        known &= following <= last
        starts, following, numbers = starts[known], following[known], numbers[known]
        if not len(starts) or starts[0] != at:
            return at
        taken = chain(starts, following)
        offsets, numbers = starts[taken] + _HEAD.size + 2, numbers[taken]
        for number in np.unique(numbers).tolist():
            topic = self._topic_of.get(number)
            if topic is not None:
                its = offsets[numbers == number]
                topic.offsets.frombytes(its.tobytes())
                self._time = max(self._time, int(self._stamps[its + topic.layout.timestamp].max()))
        return int(following[taken[-1]])

    def _resume(self, at: int, kind: int, stop: int) -> int:
        """Where to look after what is no message: at the next byte, whatever its length says.

        Only types are read to their end before they are refused; so that this costs no more than
        the file is long, bytes that have been read in vain are left out from then on.
        """
        if kind == ord("F") and self._wasted > len(self.data) >= stop:
            return stop
        return at + 1

    def _begins(self, at: int) -> bool:
        """Whether a message begins there that may be one, as far as its head says."""
        if at + _HEAD.size + 2 > len(self.data):
            return True
        size, kind = _HEAD.unpack_from(self.data, at)
        if kind != ord("D"):
            return kind in KINDS and size > 0
        number = int(self._words[at + _HEAD.size])
        return bool(self._least[number] <= size <= self._most[number])

    def _sure(self, body: int, kind: int, stop: int) -> bool:
        """Whether a message behind damage is followed by one; those that are taken prove it."""
        if kind == ord("D") and stop - body > 1 and int(self._words[body]) in self._topic_of:
            return True
        return self._begins(stop)

    def _is_new(self, at: int) -> bool:
        """Whether it is a message of a kind that is newer than this: one that is known follows."""
        for _ in range(MOST_IN_A_ROW + 1):
            if at + _HEAD.size > len(self.data):
                return at == len(self.data)
            size, kind = _HEAD.unpack_from(self.data, at)
            if kind in KINDS:
                return self._begins(at)
            if not kind or not 0 < size <= LONGEST_UNKNOWN:
                return False
            at += _HEAD.size + size
        return False

    def _record(self, body: int, stop: int) -> bool:
        if stop - body < 2:
            return False
        number = self.data[body] | self.data[body + 1] << 8
        topic = self._topic_of.get(number)
        if topic is None:
            return number in self._others
        layout, size = topic.layout, stop - body - 2
        if not layout.dtype.itemsize <= size <= layout.longest:
            return False
        topic.offsets.append(body + 2)
        at = body + 2 + layout.timestamp
        self._time = max(self._time, int.from_bytes(self.data[at : at + 8], "little"))
        return True

    def _type(self, body: int, stop: int) -> bool:
        good = self._types.learn(bytes(self.data[body:stop]))
        self._wasted += 0 if good else stop - body
        return good

    def _subscription(self, body: int, stop: int) -> bool:
        if stop - body < 4:
            return False
        instance, number = struct.unpack_from("<BH", self.data, body)
        text = bytes(self.data[body + 3 : min(stop, body + 3 + LONGEST_KEY + 1)])
        if not is_name(text):
            return False
        self._defining, name = False, text.decode("ascii")
        self._topic_of.pop(number, None)
        self._others.add(number)
        self._least[number], self._most[number] = 2, 65535
        if name not in self.wanted:
            return True
        if name not in self._layouts:
            self._layouts[name] = self._types.layout(name)
        layout = self._layouts[name]
        if layout is None:
            return False
        topic = self.index.topics.setdefault((name, instance), Topic(layout))
        if topic.layout != layout:
            return False
        self._topic_of[number] = topic
        self._least[number] = 2 + layout.dtype.itemsize
        self._most[number] = min(2 + layout.longest, 65535)
        return True

    def _parameter(self, body: int, stop: int) -> bool:
        length = self.data[body] if stop > body else 0
        key = bytes(self.data[body + 1 : body + 1 + length]).decode("ascii", "replace")
        kind, _, name = key.partition(" ")
        form = {"float": "<f", "int32_t": "<i"}.get(kind)
        if form is None or not name or stop - body != 1 + length + 4:
            return False
        (value,) = struct.unpack_from(form, self.data, body + 1 + length)
        index = self.index
        if len(index.initial) + len(index.changed) >= MOST_PARAMETERS:
            return False
        if self._defining:
            index.initial[name] = float(value)
        else:
            index.changed.append((self._time, name, float(value)))
        return True

    def _dropout(self, body: int, stop: int) -> bool:
        if stop - body != 2:
            return False
        self.index.dropouts += 1
        self.index.dropped_ms += int.from_bytes(self.data[body:stop], "little")
        return True

    def _flags(self, body: int, stop: int) -> bool:
        if body != HEADER_LENGTH + _HEAD.size or stop - body < 40:
            return False
        incompatible = bytes(self.data[body + 8 : body + 16])
        if incompatible[0] & ~1 or any(incompatible[1:]):
            raise RecordingError("a ULog with a feature that is not known here")
        if incompatible[0] & 1:
            offsets = struct.unpack_from("<3Q", self.data, body + 16)
            self._jumps = sorted(n for n in offsets if stop <= n < len(self.data))
        return True


def index_ulog(data: Bytes, wanted: frozenset[str]) -> UlogIndex:
    """Find the records of the ``wanted`` topics; damage is counted.

    Raises:
        RecordingError: the header is not a ULog's, or says that it cannot be read.
    """
    if len(data) < HEADER_LENGTH or data[: len(MAGIC)] != MAGIC:
        raise RecordingError("a ULog whose header is damaged")
    walk = _Walk(data, wanted)
    walk.run()
    return walk.index


def columns_of(records: Records) -> dict[str, NDArray[Any]]:
    """Fields by name, (n,) each; elements of an array as ``name[i]``."""
    columns: dict[str, NDArray[Any]] = {}
    for name in records.dtype.names or ():
        values = records[name]
        if values.ndim == 1:
            columns[name] = values
        elif values.shape[1] <= UNFOLDED:
            columns.update({f"{name}[{i}]": values[:, i] for i in range(values.shape[1])})
    return columns
