"""The messages asked for, of a recording of any kind, as structured arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from mmap import ACCESS_READ, mmap
from pathlib import Path

from onboard.errors import RecordingError
from onboard.recordings.dataflash_arrays import dataflash_tables
from onboard.recordings.dataflash_formats import Records
from onboard.recordings.dataflash_index import index_dataflash
from onboard.recordings.opening import kind_of
from onboard.recordings.recording import damage_notes
from onboard.recordings.tlog_arrays import message_numbers, tlog_tables
from onboard.recordings.tlog_index import index_tlog
from onboard.recordings.ulog import damage_of
from onboard.recordings.ulog_index import index_ulog


@dataclass(frozen=True, slots=True)
class Arrays:
    """What was asked for of a file.

    Attributes:
        kind: ``dataflash``, ``tlog`` or ``ulog``.
        tables: structured arrays (n,) by name, each in the order of the file; without the names
            that the file does not have.
        skipped_bytes: bytes that belong to nothing that can be read, in the middle and at the end.
        damage: the same in plain words.
    """

    kind: str
    tables: Mapping[str, Records]
    skipped_bytes: int
    damage: tuple[str, ...]


def read_arrays(path: str | Path, names: Iterable[str]) -> Arrays:
    """Read the messages of some names, and nothing else.

    Of a DataFlash log, fields are numbers in the unit of their format letter.  Of a .tlog, a
    message is that of any sender, which it names, and a checksum is looked at only where the
    message is asked for.  Of a ULog, fields are as they were logged, without types within types;
    further instances of a topic are ``name[1]`` and so on.

    The log is read through in blocks: beside the arrays, only the places of what is asked for are
    held, ten bytes each.

    Raises:
        RecordingError: the file cannot be read, or is no recording.
    """
    path, wanted = Path(path), frozenset(names)
    kind = kind_of(path)
    with path.open("rb") as file:
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    if kind == "ulog":
        return _of_ulog(path, data, wanted)
    if kind == "dataflash":
        log = index_dataflash(data, wanted)
        tables, places = dataflash_tables(log), log.damaged_places
        skipped, cut_off = log.skipped_bytes, log.cut_off_bytes
    else:
        telemetry = index_tlog(data, message_numbers(wanted))
        tables, places = tlog_tables(telemetry), telemetry.damaged_places
        skipped, cut_off = telemetry.skipped_bytes, telemetry.cut_off_bytes
    return Arrays(kind, tables, skipped + cut_off, damage_notes(places, skipped, cut_off))


def _of_ulog(path: Path, data: mmap, wanted: frozenset[str]) -> Arrays:
    try:
        index = index_ulog(data, wanted)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    tables = {
        f"{name}[{instance}]" if instance else name: topic.records(data)
        for (name, instance), topic in sorted(index.topics.items())
        if topic.offsets
    }
    return Arrays("ulog", tables, index.skipped_bytes + index.cut_off_bytes, damage_of(index))
