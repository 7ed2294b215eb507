"""Where results go: to a place that can be written, never over what was read, one to each."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterable
from pathlib import Path

from onboard.errors import UsageError
from onboard.report.files import beside

STANDARD_OUTPUT = "-"


def refuse_overwriting(inputs: Iterable[Path | str | None], *outputs: Path | str | None) -> None:
    """See to it, before anything is read, that no result takes the place of a recording.

    Args:
        inputs: recordings and other files that are read.
        outputs: where results are to be written; None: to no file, ``-``: to standard output.

    Raises:
        UsageError: one of them is a file that is read, or the place of another result.
    """
    if outputs.count(STANDARD_OUTPUT) > 1:  # one after the other they are neither
        raise UsageError("-: two results cannot both go to standard output")
    read = [Path(file) for file in inputs if file is not None]
    given: set[Path] = set()
    for file in outputs:
        if file is None or file == STANDARD_OUTPUT:
            continue
        place = Path(file)
        # Links, too, lead to what is there; what is not there yet is nobody's.
        if any(_is_same(place, other) for other in read):
            raise UsageError(f"{file}: is read, and would be overwritten")
        if place.resolve() in given:
            raise UsageError(f"{file}: two results cannot be one file")
        given.add(place.resolve())


def refuse_unwritable(file: Path | str | None, *, anew: bool = False) -> None:
    """See to it, before hours of work, that a result can be written.

    Nothing is changed of what is there, and nothing is left where there was nothing.

    Args:
        file: where to; None or ``-``: to no file.
        anew: a new file takes the place of the one that is there; otherwise it is written over.

    Raises:
        UsageError: it cannot.
    """
    if file is None or file == STANDARD_OUTPUT:
        return
    place = Path(file)
    try:
        if place.is_dir():
            raise UsageError(f"{file}: cannot be written ({os.strerror(errno.EISDIR)})")
        if anew and place.exists() and not place.is_file():
            raise UsageError(f"{file}: is not a regular file")
        if place.is_file() and not anew:
            with place.open("r+b"):
                pass
        elif anew or not place.exists():  # a pipe, or a device, is not opened for nothing
            trial = beside(place) if anew else place.resolve()
            with contextlib.suppress(FileExistsError), trial.open("xb"):
                trial.unlink()
    except OSError as error:
        raise UsageError(f"{file}: cannot be written ({error.strerror})") from None


def _is_same(place: Path, other: Path) -> bool:
    """Whether both are names of one file."""
    try:
        return place.samefile(other)
    except OSError:  # one of them is not there
        return False
