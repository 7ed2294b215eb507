"""Opening a recording: the kind is found from the content, not from the name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from onboard.errors import RecordingError
from onboard.recordings.dataflash import is_dataflash, open_dataflash
from onboard.recordings.recording import Recording
from onboard.recordings.tlog import is_tlog, open_tlog
from onboard.recordings.ulog import is_ulog, open_ulog

HEAD_LENGTH = 65536


OPENERS: dict[str, Callable[[Path], Recording]] = {
    "ulog": open_ulog,
    "dataflash": open_dataflash,
    "tlog": open_tlog,
}


def open_recording(path: str | Path) -> Recording:
    """Open a .tlog, DataFlash .BIN or .ulg file.

    A log that is damaged or cut off is read as far as it goes; its ``damage`` says so.

    Raises:
        RecordingError: no such file, not a file, not a log, or nothing in it that can be used.
    """
    path = Path(path)
    return OPENERS[kind_of(path)](path)


def kind_of(path: Path) -> str:
    """``ulog``, ``dataflash`` or ``tlog``, by the content.

    Raises:
        RecordingError: no such file, not a file, or none of these.
    """
    if path.is_dir():
        raise RecordingError(f"{path}: is a directory; onboard fleet takes all that is in it")
    if path.exists() and not path.is_file():
        raise RecordingError(f"{path}: is no regular file; a recording has to be read twice")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_LENGTH)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror})") from None
    if not head:
        raise RecordingError(f"{path}: is empty; copy it again, or take another flight's")
    if is_ulog(head):
        return "ulog"
    if is_dataflash(head):
        return "dataflash"
    if is_tlog(head):
        return "tlog"
    raise RecordingError(f"{path}: not a .tlog, DataFlash .BIN or .ulg recording")
