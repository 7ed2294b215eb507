"""Where the records of a DataFlash log are, and what their bytes mean.

A log is a sequence of records ``A3 95 type payload``; FMT records (type 128) give the length
and the fields of every other type.  The walk keeps the place of each record that is wanted
(ten bytes each), so that a log of any size is afterwards read in blocks.  pymavlink's
``DFReader`` has such an index too, but it prints on damage, recurses over it, and gives up on a
log that has one format letter it does not know.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.recordings.dataflash_formats import Format, Records
from onboard.recordings.dataflash_walk import Bytes, Walk


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
    cut_off_bytes: int

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
        if not len(offsets):
            return np.zeros(0, form.dtype)
        # At every byte of the log a record might begin: overlapping ones, of which some are taken.
        everywhere: Records = np.ndarray(
            (len(self.data) - form.length + 1,), f"V{form.length}", self.data, strides=(1,)
        )
        return everywhere[offsets].view(form.dtype)

    def all_of(self, name: str, block: int = 65536) -> Iterator[tuple[Format, Records]]:
        """All records of one name, in blocks."""
        for slot, form in enumerate(self.formats):
            if form.name == name:
                places = self.offsets[self.slots == slot]
                for start in range(0, len(places), block):
                    yield form, self.gather(slot, places[start : start + block])


def index_dataflash(data: Bytes, wanted: frozenset[str]) -> DataflashIndex:
    """Find the records of the ``wanted`` names; never raises on damage, counts it instead."""
    walk = Walk(data, wanted)
    walk.run()
    return DataflashIndex(
        data=data,
        formats=tuple(walk.formats),
        slots=np.frombuffer(walk.slots, np.uint16),
        offsets=np.frombuffer(walk.offsets, np.int64),
        records=walk.records,
        damaged_places=walk.damaged_places,
        skipped_bytes=walk.skipped_bytes,
        cut_off_bytes=walk.cut_off_bytes,
    )
