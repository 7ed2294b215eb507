"""The cells of a table (CSV) as numbers, and what stands in those that are none."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol, TextIO

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.errors import RecordingError

DELIMITERS = ",;\t"
FEWEST_ROWS = 20
"""Rows of any quantity, below which there is no flight: two seconds at 10 Hz [bound]."""
LONGEST_HEAD = 1_000_000
"""Characters of the names of all columns: 10,000 of a hundred each [bound]."""
NO_NUMBERS = ("", "nan", "null", "none", "na")
LONGEST_WORD = 30
"""Characters of a cell that a sentence repeats [use]."""


class _Rows(Protocol):
    """What the standard library's reader of tables is; it has no name there."""

    line_num: int

    def __iter__(self) -> Iterator[list[str]]: ...


def cells_of(path: Path, wanted: list[str]) -> tuple[dict[str, Array], Array]:
    """The wanted columns, NaN where a cell holds no number; and the line of each row."""
    if path.exists() and not path.is_file():
        raise RecordingError(f"{path}: is not a regular file")
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            names, reader = _begun(file)
            missing = [name for name in wanted if name not in names]
            if missing:
                there = ", ".join(names[:20])
                raise RecordingError(f"{path}: has no column {missing[0]!r} (there: {there})")
            places = [names.index(name) for name in wanted]
            rows = [  # the head is line one, of which this reader does not know
                [reader.line_num + 1, *(_cell(row[k]) if k < len(row) else np.nan for k in places)]
                for row in reader
                if row
            ]
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: no table of text ({error})") from None
    if len(rows) < FEWEST_ROWS:
        raise RecordingError(f"{path}: {len(rows)} rows are too few for a flight")
    every = np.array(rows, dtype=np.float64)
    return {name: every[:, k] for k, name in enumerate(wanted, 1)}, every[:, 0]


def _cell(text: str) -> float:
    """A number, or NaN: what is no number is no measurement."""
    text = text.strip()
    if text.lower() in NO_NUMBERS:
        return float("nan")
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _begun(file: TextIO) -> tuple[list[str], _Rows]:
    """Names of the columns of an open table, and the rows below them."""
    head = file.readline(LONGEST_HEAD).lstrip("# ")
    delimiter = max(DELIMITERS, key=head.count)
    names = [name.strip() for name in next(csv.reader([head], delimiter=delimiter), [])]
    return names, csv.reader(file, delimiter=delimiter)


def word_in(path: Path, column: str) -> str:
    """The first of a column's cells that is neither empty nor a number; empty if there is none."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        names, rows = _begun(file)
        place = names.index(column)
        for row in rows:
            text = row[place].strip() if place < len(row) else ""
            if text.lower() not in NO_NUMBERS and not np.isfinite(_cell(text)):
                return text[:LONGEST_WORD]
    return ""
