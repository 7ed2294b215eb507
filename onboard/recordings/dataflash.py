"""DataFlash logs (.BIN) of ArduPilot, from version 3.1 on, as recordings."""

from __future__ import annotations

from collections.abc import Iterator
from mmap import ACCESS_READ, mmap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import Piece
from onboard.core.inputs.samples import Sample
from onboard.errors import RecordingError
from onboard.recordings.bulk import no_collection
from onboard.recordings.dataflash_batch import Batch, record_times
from onboard.recordings.dataflash_columns import block_of, samples_in_order
from onboard.recordings.dataflash_context import GPS_NAMES, Context, Floats, context_of
from onboard.recordings.dataflash_formats import parse_format
from onboard.recordings.dataflash_index import DataflashIndex, index_dataflash
from onboard.recordings.dataflash_records import (
    ATTITUDE_NAMES,
    CONVERTERS,
    IMU_NAMES,
    NEEDED,
)
from onboard.recordings.dataflash_walk import FMT_LENGTH, MAGIC
from onboard.recordings.recording import Recording, because_of, damage_notes, elapsed_s

Integers = NDArray[np.int64]

BLOCK = 4096
"""Records converted at a time: bounds the memory, whatever the length of the log [cost]."""
WANTED = frozenset(CONVERTERS) | {"GPA"}


OF_VIEW = (
    "in its hovering modes ATT is not the body's attitude, and there is no XKF1, which always is: "
    "set EK3_LOG_LEVEL to 0, or fly it forward"
)


def is_dataflash(head: bytes) -> bool:
    """Whether a file that begins so is a DataFlash log: with an FMT record, or one that is whole.

    Three bytes are not enough: packets of one telemetry log in 250 have them by chance.
    """
    start = MAGIC + b"\x80"
    at = head.find(start)
    while at > 0:
        record = head[at : at + FMT_LENGTH]
        layout = parse_format(record) if len(record) == FMT_LENGTH else None
        if layout is not None and layout.dtype is not None and layout.columns:
            return True
        at = head.find(start, at + 1)
    return at == 0


def open_dataflash(path: Path) -> Recording:
    """Index a log.

    Raises:
        RecordingError: it holds no inertial record with a time.
    """
    with path.open("rb") as file:
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    index = index_dataflash(data, WANTED)
    usable = _usable_slots(index)
    imu_slots = [k for k in usable if index.formats[k].name in IMU_NAMES]
    damage = damage_notes(index.damaged_places, index.skipped_bytes, index.cut_off_bytes)
    if not np.isin(index.slots, imu_slots).any():
        raise RecordingError(
            f"{path}: a DataFlash log without inertial records (IMU) that have a time; "
            f"fly with IMU in LOG_BITMASK{because_of(damage)}"
        )
    t = _times(index, imu_slots)
    with np.errstate(all="ignore"):  # damaged bytes make any number
        context = context_of(index, float(t[0]))
    unused = {*ATTITUDE_NAMES} - {context.attitude_from}
    usable = frozenset(k for k in usable if index.formats[k].name not in unused)

    def read() -> Iterator[Sample]:
        return _samples(index, usable, context)

    def gather() -> Iterator[Piece]:
        return _blocks(index, usable, context)

    return Recording(
        path=path,
        kind="dataflash",
        autopilot="ardupilot",
        duration_s=elapsed_s(t),
        counts=index.counts(),
        read=read,
        damage=damage,
        notes=(OF_VIEW,) if context.of_view else (),
        gather=gather,
    )


def _usable_slots(index: DataflashIndex) -> frozenset[int]:
    """Formats that have the fields we need, and for measurements a time of their own."""
    usable = set()
    for slot, form in enumerate(index.formats):
        timed = form.has("TimeUS") or form.has("T" if form.name in GPS_NAMES else "TimeMS")
        complete = form.name in CONVERTERS and form.has(*NEEDED.get(form.name, ()))
        if complete and (timed or form.name in {"PARM", "EV", "MSG"}):
            usable.add(slot)
    return frozenset(usable)


def _times(index: DataflashIndex, slots: list[int]) -> Floats:
    """Times of the records of some formats in the order of the file, s."""
    offsets = index.offsets[np.isin(index.slots, slots)]
    kinds = index.slots[np.isin(index.slots, slots)]
    t = np.full(len(offsets), np.nan)
    for slot in slots:
        places = np.flatnonzero(kinds == slot)
        for start in range(0, len(places), BLOCK):
            rows = places[start : start + BLOCK]
            times = record_times(index.formats[slot], index.gather(slot, offsets[rows]))
            if times is not None:
                t[rows] = times
    return t


def _batches(
    index: DataflashIndex, usable: frozenset[int], context: Context
) -> Iterator[list[tuple[Integers, Batch]]]:
    """Records block by block, of each format together."""
    keep = np.isin(index.slots, list(usable))
    offsets, slots = index.offsets[keep], index.slots[keep]
    last = context.first_time
    for start in range(0, len(offsets), BLOCK):
        block = slice(start, start + BLOCK)
        batches, last = _batches_of(index, offsets[block], slots[block], last)
        yield batches


def _batches_of(
    index: DataflashIndex, offsets: Integers, slots: NDArray[np.uint16], last: float
) -> tuple[list[tuple[Integers, Batch]], float]:
    """Records of a block by their format, and the time of its last record."""
    groups = [(slot, np.flatnonzero(slots == slot)) for slot in np.unique(slots).tolist()]
    records = {slot: index.gather(slot, offsets[rows]) for slot, rows in groups}
    t = np.full(len(offsets) + 1, np.nan)
    t[0] = last
    for slot, rows in groups:
        times = record_times(index.formats[slot], records[slot])
        if times is not None:
            t[rows + 1] = times
    # A record without a time of its own takes that of the one before it.
    known = np.where(np.isfinite(t), np.arange(len(t)), 0)
    t = t[np.maximum.accumulate(known)]
    batches = [(rows, Batch(index.formats[s], records[s], t[rows + 1])) for s, rows in groups]
    return batches, float(t[-1])


def _samples(index: DataflashIndex, usable: frozenset[int], context: Context) -> Iterator[Sample]:
    for batches in _batches(index, usable, context):
        with no_collection():
            samples, _ = samples_in_order(batches, context)
        yield from samples


def _blocks(index: DataflashIndex, usable: frozenset[int], context: Context) -> Iterator[Piece]:
    for batches in _batches(index, usable, context):
        with no_collection(), np.errstate(all="ignore"):  # damaged bytes make any number
            block = block_of(batches, context)
        yield block
