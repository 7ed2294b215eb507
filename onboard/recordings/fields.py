"""Fields of messages where they are what their name promises: a log defines its own layouts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.recordings.arrays import Arrays
from onboard.recordings.dataflash_formats import Records

AUTOPILOT = 1
"""MAV_COMP_ID_AUTOPILOT1."""
NUMBERS, TEXT = "iufb", "S"
"""Kinds of a type of NumPy; that of an array within a record is neither."""


def numbers(records: Records, *names: str) -> NDArray[np.float64] | None:
    """(k, n) of k fields; None where one is absent or is no number."""
    if not all(_is(records, name, NUMBERS) for name in names):
        return None
    return np.array([records[name] for name in names], dtype=np.float64)


def texts(records: Records | None, name: str) -> list[str]:
    """The words of a field; none where it is absent or is no text."""
    if records is None or not _is(records, name, TEXT):
        return []
    return [bytes(x).decode("ascii", "replace") for x in records[name]]


def of_autopilot(arrays: Arrays, name: str) -> Records | None:
    """Messages of a .tlog that the autopilot has sent; None of another recording."""
    table = arrays.tables.get(name)
    if table is None or arrays.kind != "tlog":
        return None
    sent: Records = table[table["sender_component"] == AUTOPILOT]
    return sent


def _is(records: Records, name: str, kinds: str) -> bool:
    return name in (records.dtype.names or ()) and records.dtype[name].kind in kinds
