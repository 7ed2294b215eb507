"""Recordings in folders."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from onboard.errors import UsageError
from onboard.printable import printable

KINDS = (".bin", ".tlog", ".ulg")
"""Ends of the names of what is looked for in folders, in any case of letters."""


def found(places: Sequence[Path]) -> list[tuple[Path, str]]:
    """Recordings in these folders and below, in order, with their names within the folder.

    Where several folders have the same name in them, it has the folder before it.

    Raises:
        UsageError: a place that is not there, or no recording anywhere.
    """
    files: dict[Path, tuple[Path, str]] = {}
    for place in places:
        if place.is_dir():
            inside = (p for p in place.rglob("*") if p.suffix.lower() in KINDS and p.is_file())
            files.update({p: (place, str(p.relative_to(place))) for p in sorted(inside)})
        elif place.exists():
            files[place] = place.parent, place.name
        else:
            raise UsageError(f"{place}: no such folder or file")
    if not files:
        where = ", ".join(map(str, places))
        raise UsageError(f"{where}: no recording ({', '.join(KINDS)}) there or below")
    return list(zip(files, _told_apart(list(files.values())), strict=True))


def _told_apart(places: Sequence[tuple[Path, str]]) -> Iterator[str]:
    """Names within the folders; with the folder's where several folders have the same."""
    names = [printable(name) for _, name in places]
    once = Counter(names)
    names = [
        name if once[name] == 1 else printable(str(Path(place.absolute().name) / name))
        for name, (place, _) in zip(names, places, strict=True)
    ]
    twice = Counter(names)
    last = [
        name if twice[name] == 1 else printable(str(place.absolute() / inside))
        for name, (place, inside) in zip(names, places, strict=True)
    ]
    counted: Counter[str] = Counter()
    for name in last:  # names that differ in what cannot be shown
        counted[name] += 1
        yield name if counted[name] == 1 else f"{name} ({counted[name]})"
