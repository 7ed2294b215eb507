"""What the functions take: a file, columns, or several of either."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from onboard.api.array_recording import recording_of
from onboard.api.arrays import Arrays
from onboard.errors import UsageError
from onboard.recordings.recording import Recording

Source: TypeAlias = str | os.PathLike[str] | Arrays
"""A recording's file (.BIN, .tlog, .ulg), or its columns."""


def opened(source: Source | Sequence[Source]) -> list[Path | Recording]:
    """One recording or several, in the order given.

    Raises:
        UsageError: something else was given, or the same columns twice.
    """
    every = [source] if isinstance(source, str | os.PathLike | Arrays) else source
    if not isinstance(every, Sequence):
        raise UsageError(f"a {type(source).__name__} is no recording: give a file or Arrays")
    return [_one(given, every[:k]) for k, given in enumerate(every)]


def _one(given: Source, before: Sequence[Source]) -> Path | Recording:
    if isinstance(given, str | os.PathLike):
        return Path(given)
    if not isinstance(given, Arrays):
        raise UsageError(f"a {type(given).__name__} is no recording: give a file or Arrays")
    same = [other for other in before if isinstance(other, Arrays) and other.name == given.name]
    if any(other is given for other in same):
        raise UsageError(f"{given.name}: given twice")
    # Columns have no path that would tell them apart.
    return recording_of(given, f"{given.name} ({len(same) + 1})" if same else given.name)
