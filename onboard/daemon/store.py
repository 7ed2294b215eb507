"""The sums on disk: what the daemon has learned of each vehicle, across restarts.

With them goes what the diagnosis of the last flight said: without it nothing may be written, and
the flight itself is not kept.

One file per vehicle (system id), replaced whole: temporary file, fsync, rename, fsync of the
directory.  A file that is damaged or of another version is set aside with the reason, never half
used.  Whether sums are of the sensor that is there now, the estimator itself looks after.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from zlib import crc32

import msgspec

from onboard.errors import StateError
from onboard.push.physics import Diagnosed

SCHEMA = 1


class Saved(msgspec.Struct, frozen=True, kw_only=True):
    """The sums of one vehicle; ``saved_at`` is Unix time, ``diagnosed`` encoded, or empty."""

    schema: int = SCHEMA
    version: str
    system_id: int
    saved_at: float
    sums: bytes
    check: int
    diagnosed: bytes = b""


class Kept(msgspec.Struct, frozen=True):
    """A diagnosis, and the INS_ACCn_ID of the accelerometer that it is about."""

    device_id: float
    diagnosed: Diagnosed


class Store:
    """Reads and writes the files.

    Raises:
        StateError: the directory cannot be made.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StateError(f"{directory}: {error.strerror}") from None

    def path(self, system_id: int) -> Path:
        """File of one vehicle."""
        return self.directory / f"sums-{system_id}.bin"

    def load(self, system_id: int) -> Saved | None:
        """What was saved for this vehicle, None if nothing was.

        Raises:
            StateError: there is a file, but it cannot be used; it has been set aside.
        """
        path = self.path(system_id)
        try:
            saved = msgspec.msgpack.decode(path.read_bytes(), type=Saved)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StateError(f"{path}: {error.strerror}") from None
        except msgspec.DecodeError:
            raise StateError(f"{path}: damaged, set aside as {self.set_aside(system_id)}") from None
        if saved.schema != SCHEMA or crc32(saved.sums + saved.diagnosed) != saved.check:
            why = "damaged" if saved.schema == SCHEMA else f"of version {saved.schema}"
            raise StateError(f"{path}: {why}, set aside as {self.set_aside(system_id)}")
        return saved

    def save(
        self,
        system_id: int,
        sums: bytes,
        *,
        version: str,
        saved_at: float,
        diagnosed: Sequence[Kept] = (),
    ) -> None:
        """Replace the file; it is on the disk when this returns.

        Raises:
            StateError: it could not be written; the file before is untouched.
        """
        path = self.path(system_id)
        found = msgspec.msgpack.encode(diagnosed) if diagnosed else b""
        saved = Saved(
            version=version,
            system_id=system_id,
            saved_at=saved_at,
            sums=sums,
            check=crc32(sums + found),
            diagnosed=found,
        )
        temporary = path.with_suffix(".new")
        try:
            with temporary.open("wb") as file:
                file.write(msgspec.msgpack.encode(saved))
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
            directory = os.open(self.directory, os.O_RDONLY)
            try:
                os.fsync(directory)
            finally:
                os.close(directory)
        except OSError as error:
            raise StateError(f"{path}: {error.strerror}") from None

    @staticmethod
    def diagnoses(saved: Saved) -> dict[int, Kept]:
        """What was diagnosed, by accelerometer; nothing if another version wrote it differently."""
        if not saved.diagnosed:
            return {}
        try:
            kept = msgspec.msgpack.decode(saved.diagnosed, type=list[Kept])
        except msgspec.DecodeError:
            return {}
        return {one.diagnosed.imu: one for one in kept}

    def set_aside(self, system_id: int) -> str:
        """Rename the file so that it is not read again but can be looked at; its new name."""
        path = self.path(system_id)
        aside = path.with_suffix(".refused")
        try:
            path.replace(aside)
        except OSError as error:
            return f"(not renamed: {error.strerror})"
        return aside.name
