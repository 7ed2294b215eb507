"""Where results go: never over what was read, nor two of them to one place."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from onboard.errors import UsageError

STANDARD_OUTPUT = "-"


def refuse_overwriting(inputs: Iterable[Path | str | None], *outputs: Path | str | None) -> None:
    """See to it, before anything is read, that no result takes the place of a recording.

    Args:
        inputs: recordings and other files that are read.
        outputs: where results are to be written; None or ``-``: to no file.

    Raises:
        UsageError: one of them is a file that is read, or the place of another result.
    """
    read = [Path(file) for file in inputs if file is not None]
    given: set[Path] = set()
    for file in outputs:
        if file is None or file == STANDARD_OUTPUT:
            continue
        place = Path(file)
        # Links, too, lead to what is there; what is not there yet is nobody's.
        if place.exists() and any(_is_same(place, other) for other in read):
            raise UsageError(f"{file}: is read, and would be overwritten")
        if place.resolve() in given:
            raise UsageError(f"{file}: two results cannot be one file")
        given.add(place.resolve())


def _is_same(place: Path, other: Path) -> bool:
    """Whether both are names of one file."""
    try:
        return place.samefile(other)
    except OSError:  # the other is not there
        return False
