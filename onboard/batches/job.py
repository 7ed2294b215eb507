"""One recording to be replayed, and what came of it: what goes to a process and comes back."""

from __future__ import annotations

import gzip
import hashlib
import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path

import msgspec

import onboard
from onboard import __version__
from onboard.answers.fleet.record import Record, record_of
from onboard.answers.recorded import Recorded
from onboard.answers.replay import Replay, replay
from onboard.batches.store import Store
from onboard.errors import OnboardError
from onboard.recordings.provenance import provenance

CODE = ("answers", "core", "mavlink", "recordings", "report")
"""Rooms that a record and a page come from."""
BLOCK = 1 << 20
"""Bytes of a file that are hashed at once [cost]."""


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """One recording; ``paged``: a report is wanted; ``store``: a folder, or empty.

    ``path`` is what the system calls it: bytes, which need not be text.
    """

    path: bytes
    imu: int | None = None
    paged: bool = False
    store: str = ""
    version: str = ""

    @property
    def file(self) -> Path:
        """Where it is."""
        return Path(os.fsdecode(self.path))


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a job: a record, or an error; ``page`` is its report, packed by gzip."""

    record: Record | None = None
    error: str = ""
    page: bytes = b""
    notes: tuple[str, ...] = ()
    stored: bool = False


@cache
def version() -> str:
    """What decides on the last digit beside the log: version, source files, compiled loops."""
    digest = hashlib.sha256(__version__.encode())
    root = Path(onboard.__file__).parent
    for room in CODE:
        for file in sorted((root / room).rglob("*")):
            if file.suffix in {".py", ".j2", ".css"}:
                digest.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes())
    compiled = "numba" if find_spec("numba") is not None else "numpy"
    return f"{__version__}-{compiled}-{digest.hexdigest()[:16]}"


def done(job: Job, progress: Callable[[float], None] | None = None) -> Outcome:
    """Replay a recording, or take its result from the store.

    What goes wrong with it, whatever it is, is the outcome's error: the others go on.
    """
    if job.version and job.version != version():
        return Outcome(error=f"replayed by another version ({version()}, here {job.version})")
    path = job.file
    try:
        return _done(job, path, progress)
    except OnboardError as error:
        return Outcome(error=str(error))
    except MemoryError:
        return Outcome(error=f"{path}: more memory than there is")
    except OSError as error:
        return Outcome(error=f"{path}: cannot be read ({error.strerror})")
    except Exception as error:  # noqa: BLE001 - a fault of ours on one log costs that log
        return Outcome(error=f"{path}: could not be replayed ({type(error).__name__}: {error})")


def _done(job: Job, path: Path, progress: Callable[[float], None] | None) -> Outcome:
    sha256 = content(path)
    store = Store(Path(job.store)) if job.store else None
    notes: list[str] = []
    key = f"{sha256}-{_options(job)}"
    if store is not None:
        record, page = store.record(key, notes), store.page(key, notes) if job.paged else b""
        if record is not None and page is not None:
            shown = _named(page, sha256, path)
            return Outcome(record=record.named(path), page=shown, notes=tuple(notes), stored=True)
    wanted = () if job.imu is None else (job.imu,)
    recorded = Recorded(wanted, watched=job.paged, one_of_several=True)
    result = replay([path], recorded, imu=job.imu, progress=progress)
    record, page = record_of(path, result, recorded, provenance(path), sha256), b""
    if job.paged and recorded.chronicle is not None:
        from onboard.report.replay import replay_html  # noqa: PLC0415 - templates only when wanted

        html = replay_html(_nameless(result, sha256), recorded.chronicle)
        page = gzip.compress(html.encode("utf-8", "replace"), mtime=0)
    if store is not None:
        store.keep(key, record, page if job.paged else None, notes)
    return Outcome(record=record, page=_named(page, sha256, path), notes=tuple(notes))


def _nameless(result: Replay, sha256: str) -> Replay:
    """The same of a file that is called by its content, as what is kept of it is."""
    recordings = tuple(replace(r, path=Path(sha256)) for r in result.recordings)
    return replace(result, recordings=recordings)


def _named(page: bytes, sha256: str, path: Path) -> bytes:
    """The page of such a file, packed, with the name that the file has now; empty: no page."""
    if not page:
        return page
    name = escape(path.name).encode("utf-8", "replace")
    return gzip.compress(gzip.decompress(page).replace(sha256.encode(), name), mtime=0)


def content(path: Path) -> str:
    """SHA-256 of a file in hex; empty for what is no file."""
    if not path.is_file():
        return ""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _options(job: Job) -> str:
    """What matters beside the content, in short."""
    said = f"{version()}|imu={job.imu}"
    return hashlib.sha256(said.encode()).hexdigest()[:16]
