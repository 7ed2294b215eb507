"""The signing's time stamps on disk, so that a restart neither believes nor repeats old ones."""

from __future__ import annotations

import logging
import os
from pathlib import Path

import msgspec

from onboard.mavlink.signing import SigningRecord

LONGEST = 1 << 16
"""bytes; 256 streams take 8000."""
logger = logging.getLogger(__name__)


class SigningFile:
    """One small file, replaced as a whole; a disk that does not take it is told once."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._failed = False

    def load(self) -> SigningRecord:
        """What an earlier run has left; nothing, if there is none or it cannot be used."""
        try:
            with self._path.open("rb") as file:
                data = file.read(LONGEST)
            return msgspec.json.decode(data, type=SigningRecord)
        except FileNotFoundError:
            return SigningRecord()
        except (OSError, ValueError, msgspec.MsgspecError, RecursionError) as error:
            logger.warning("%s: %s; signed packets of before may be believed", self._path, error)
            return SigningRecord()

    def save(self, record: SigningRecord) -> None:
        """Replace it."""
        temporary = self._path.with_suffix(".new")
        try:
            with temporary.open("wb") as file:
                os.fchmod(file.fileno(), 0o600)
                file.write(msgspec.json.encode(record))
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(self._path)
        except OSError as error:
            if not self._failed:
                logger.error("%s: %s", self._path, error.strerror)  # noqa: TRY400 - a full disk is no bug of ours
            self._failed = True
        else:
            self._failed = False
