"""Many recordings, each replayed on its own; one that cannot be read does not stop the rest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import msgspec

from onboard.answers.chronicle import Chronicle
from onboard.answers.recorded import Recorded
from onboard.answers.replay import Progress, Replay, replay
from onboard.answers.replay_document import ReplayDocument
from onboard.errors import OnboardError, UsageError

SCHEMA = "onboard.fleet/1"
KINDS = (".bin", ".tlog", ".ulg")
"""Ends of the names of what is looked for in folders, in any case of letters."""


@dataclass(frozen=True, slots=True)
class Flown:
    """One recording: its replay, or why there is none.  ``name`` is as people see it."""

    path: Path
    name: str
    replay: Replay | None
    chronicle: Chronicle | None
    error: str = ""


class Watching(Protocol):
    """Told of each file before it is read; what it gives back is told of the progress."""

    def __call__(
        self, path: Path, number: int, total: int, /
    ) -> AbstractContextManager[Progress | None]:
        """File ``number`` of ``total`` begins."""


class RecordingEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One recording: ``replay`` as ``onboard replay --json`` writes it, or ``error``."""

    file: str
    error: str | None
    replay: ReplayDocument | None


class FleetDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``onboard fleet --json``."""

    recordings: list[RecordingEntry]
    read: int
    failed: int
    schema: str = SCHEMA

    @classmethod
    def of(cls, flown: Iterable[Flown]) -> FleetDocument:
        """The document of these recordings."""
        entries = [
            RecordingEntry(
                file=str(one.path),
                error=one.error or None,
                replay=None if one.replay is None else one.replay.document(),
            )
            for one in flown
        ]
        failed = sum(entry.error is not None for entry in entries)
        return cls(recordings=entries, read=len(entries) - failed, failed=failed)

    def to_json(self) -> bytes:
        """Indented JSON, ``schema`` first, with a final newline."""
        fields = msgspec.to_builtins(self)
        ordered = {"schema": fields.pop("schema"), **fields}
        return msgspec.json.format(msgspec.json.encode(ordered), indent=2) + b"\n"


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


def _unwatched(_path: Path, _number: int, _total: int, /) -> AbstractContextManager[None]:
    return nullcontext()


def fly(
    files: Sequence[tuple[Path, str]],
    *,
    imu: int | None = None,
    watched: bool = False,
    watching: Watching = _unwatched,
) -> Iterator[Flown]:
    """Replay each file by itself, in order.

    Args:
        files: as :func:`found` gives them.
        imu: answer for this accelerometer only.
        watched: keep what a report draws.
        watching: told of what is going on.
    """
    for number, (path, name) in enumerate(files, start=1):
        recorded = Recorded(() if imu is None else (imu,), watched=watched)
        try:
            with watching(path, number, len(files)) as progress:
                result = replay([path], recorded, imu=imu, progress=progress)
        except OnboardError as error:
            yield Flown(path, name, None, None, str(error))
        else:
            yield Flown(path, name, result, recorded.chronicle)
