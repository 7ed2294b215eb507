"""Records of a DataFlash log as one structured array for each name."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.recordings.dataflash_formats import FIELD_TYPES, Format, Records
from onboard.recordings.dataflash_index import DataflashIndex
from onboard.recordings.pace import block_length
from onboard.recordings.text_columns import until_nul

Integers: TypeAlias = NDArray[np.int64]

TEXT = "nNZ"
OCTETS = "Data"
"""The field of 64 bytes that is no text, but a piece of a file."""


def dataflash_tables(index: DataflashIndex) -> dict[str, Records]:
    """All records of an index by name, in the order of the file.

    Fields are numbers in the unit that their format letter implies: those with a divisor are
    float64, the others have their own type.  A name that was defined in several ways, as in logs
    that were joined, has the fields that all of its layouts have.
    """
    counts = np.bincount(index.slots, minlength=len(index.formats))
    layouts: dict[str, list[Format]] = {}
    for form, count in zip(index.formats, counts, strict=True):
        if count:
            layouts.setdefault(form.name, []).append(form)
    total = index.counts()
    tables = {
        name: np.empty(total[name], _common([physical(form) for form in forms]))
        for name, forms in layouts.items()
    }
    filled = dict.fromkeys(tables, 0)
    block = block_length(len(index.slots))
    for start in range(0, len(index.slots), block):
        slots = index.slots[start : start + block]
        offsets = index.offsets[start : start + block]
        here = {slot: np.flatnonzero(slots == slot) for slot in np.unique(slots).tolist()}
        for name, forms in layouts.items():
            its = {slot: rows for slot, rows in here.items() if index.formats[slot].name == name}
            order = np.sort(np.concatenate([*its.values(), np.zeros(0, np.int64)]))
            part = tables[name][filled[name] : filled[name] + len(order)]
            filled[name] += len(order)
            for slot, rows in its.items():
                places = slice(None) if len(forms) == 1 else np.searchsorted(order, rows)
                _fill(part, places, index.formats[slot], index.gather(slot, offsets[rows]))
    return tables


def physical(form: Format) -> np.dtype[np.void]:
    """Type of the records of a layout as numbers in their units."""
    kinds = [FIELD_TYPES[letter] for letter in form.letters]
    return np.dtype(
        [
            (column, kind if divisor == 1.0 else "<f8")
            for column, (kind, divisor) in zip(form.columns, kinds, strict=True)
        ]
    )


def _common(kinds: list[np.dtype[np.void]]) -> np.dtype[np.void]:
    """The fields that all have, in types that hold each of them."""
    first, *others = kinds
    fields = []
    for name in first.names or ():
        its = [first[name], *(kind[name] for kind in others if name in (kind.names or ()))]
        if len(its) == len(kinds) and len({(x.base.kind in "SV", x.shape) for x in its}) == 1:
            fields.append((name, np.result_type(*(x.base for x in its)), its[0].shape))
    return np.dtype(fields)


def _fill(part: Records, places: slice | Integers, form: Format, records: Records) -> None:
    """Write records of one layout to some rows."""
    for column in part.dtype.names or ():
        letter = form.letter(column)
        divisor = FIELD_TYPES[letter][1]
        values = records[column]
        if letter in TEXT and column != OCTETS:
            values = until_nul(values)
        part[column][places] = values if divisor == 1.0 else values / divisor
