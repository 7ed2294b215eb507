"""What FMT records of a DataFlash log say: the fields of a type of record, and their numbers."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Records = NDArray[np.void]

HEADER_LENGTH = 3
"""bytes: two of magic, one of type [data sheet: LogStructure of ArduPilot]."""
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
SIZES = {letter: np.dtype(form).itemsize for letter, (form, _) in FIELD_TYPES.items()}
LARGEST = 2.0**53
"""Whole numbers below it are exact as floating-point ones [physics: 53 bits of a double]."""
NOT_NUMBERS = "anNZ"


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
        listed: list[int] = values.tolist()
        return listed if values.dtype.kind in "iu" else [int(value) for value in listed]


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
    sizes = [SIZES[letter] for letter in letters]
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
