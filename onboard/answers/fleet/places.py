"""Recordings in folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from onboard.errors import UsageError

KINDS = (".bin", ".tlog", ".ulg")
"""Ends of the names of what is looked for in folders, in any case of letters."""


def found(places: Sequence[Path]) -> list[tuple[Path, str]]:
    """Recordings in these folders and below, in order, with their names within the folder.

    Raises:
        UsageError: a place that is not there, or no recording anywhere.
    """
    files: dict[Path, str] = {}
    for place in places:
        if place.is_dir():
            inside = (p for p in place.rglob("*") if p.suffix.lower() in KINDS and p.is_file())
            files.update({p: str(p.relative_to(place)) for p in sorted(inside)})
        elif place.exists():
            files[place] = place.name
        else:
            raise UsageError(f"{place}: no such folder or file")
    if not files:
        where = ", ".join(map(str, places))
        raise UsageError(f"{where}: no recording ({', '.join(KINDS)}) there or below")
    return list(files.items())
