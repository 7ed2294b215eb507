"""Messages of a .tlog as one structured array for each name."""

from __future__ import annotations

import numpy as np

from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from onboard.recordings.dataflash_formats import Records
from onboard.recordings.pace import block_length
from onboard.recordings.packet_columns import Headers, headers, layout, payloads, stamps
from onboard.recordings.text_columns import until_nul
from onboard.recordings.tlog_index import TlogIndex

SENDER = (("arrived_us", "<u8"), ("sender_system", "u1"), ("sender_component", "u1"))
"""What stands before the fields of each message: when it arrived (Unix time of the ground station,
us) and who sent it."""


def tlog_tables(index: TlogIndex) -> dict[str, Records]:
    """All packets of an index by the name of the message, in the order of the file.

    Fields are as the message has them, in its order on the wire; ``SENDER`` stands before them.
    """
    data = np.frombuffer(index.data, np.uint8)
    block = block_length(len(index.offsets))
    starts = range(0, len(index.offsets), block)
    counts: dict[int, int] = {}
    for start in starts:
        head = headers(data, index.offsets[start : start + block])
        for kind, count in zip(*np.unique(head.kind, return_counts=True), strict=True):
            counts[int(kind)] = counts.get(int(kind), 0) + int(count)
    tables = {
        kind: np.empty(count, np.dtype([*SENDER, *layout(mavlink.mavlink_map[kind]).descr]))
        for kind, count in sorted(counts.items())
    }
    filled = dict.fromkeys(tables, 0)
    for start in starts:
        offsets = index.offsets[start : start + block]
        head, arrived = headers(data, offsets), stamps(data, offsets)
        for kind in np.unique(head.kind).tolist():
            rows = np.flatnonzero(head.kind == kind)
            part = tables[kind][filled[kind] : filled[kind] + len(rows)]
            filled[kind] += len(rows)
            part["arrived_us"] = arrived[rows]
            _fill(part, data, head.of(rows))
    return {mavlink.mavlink_map[kind].msgname: table for kind, table in tables.items()}


def message_numbers(names: frozenset[str]) -> frozenset[int]:
    """Numbers of the messages among some names; what the dialect does not have, no log has."""
    return frozenset(MESSAGE_IDS[name] for name in names if name in MESSAGE_IDS)


def _fill(part: Records, data: np.ndarray[tuple[int], np.dtype[np.uint8]], head: Headers) -> None:
    """Write messages of one number to some rows."""
    before = sum(np.dtype(kind).itemsize for _, kind in SENDER)
    width = part.dtype.itemsize - before
    part["sender_system"], part["sender_component"] = head.system, head.component
    octets = part.view(np.uint8).reshape(len(part), part.dtype.itemsize)
    octets[:, before:] = payloads(data, head, width)
    for name in part.dtype.names or ():
        if part.dtype[name].kind == "S":
            part[name] = until_nul(part[name])
