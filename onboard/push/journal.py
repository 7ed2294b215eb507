"""Append-only journal of pushes on disk: one JSON line per entry, durable when ``append`` returns.

Why appending and not rewriting the file for every entry: history already on disk is never
touched again, an entry costs one write and one fsync, and the only damage that a crash or
a power cut can do is a torn *last* line.  That line's write to the autopilot had not been
sent (nothing is sent before its entry is durable), so dropping it loses nothing.  Each line
carries a checksum of its entry, so that a torn line is told from a whole one.  The file is
rewritten (temporary file, fsync, rename, fsync of the directory) only to keep it small:
when it has grown past its limit and is opened, or a transaction has just closed.

A damaged line in the middle (worn SD card) is skipped and counted; what was lost with it
shows: a lost ``Closed`` leaves a transaction open, which reading the autopilot settles; a
lost ``Planned`` of an open transaction is an error, since nobody knows the old values.

**A disk that does not take it** (full, read-only, failing; now or at the start) is in ``trouble``
until it does again, and no transaction begins without it.  What only says something, and moves no
transaction (a verdict, a refusal), holds all the same: it is *owed* to the disk, and written first
when the disk takes anything.

One process at a time: the file is locked while it is open.  Methods block for the time of an
fsync (milliseconds); an asyncio driver may call them in a thread.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self
from zlib import crc32

import msgspec

from onboard.errors import DiskError, PushError, StateError
from onboard.push.entries import (
    Closed,
    Entry,
    Found,
    Planned,
    Purpose,
    ReadBack,
    Recovery,
    Refused,
    Replaced,
    Result,
    Undoing,
    Verdict,
    Watched,
)
from onboard.push.journal_file import JournalFile

SCHEMA = 1
LONGEST_LINE = 1_000_000
"""bytes; the longest entry has a few thousand."""
_REMARKS = Watched | Found | Refused | Replaced
"""Entries that neither begin a transaction nor move it."""


class Line(msgspec.Struct, frozen=True):
    """One line of the file; ``at`` is Unix time, for people; ``check`` the CRC-32 of ``entry``."""

    schema: int
    at: float
    check: int
    entry: msgspec.Raw


class Journal:
    """The journal of one daemon.

    ``trouble`` says why the disk does not take it, empty: it does; ``read`` whether it is known
    what the file says.

    Raises:
        StateError: the file cannot be opened for want of a permission or the like, is in use, or is
            of a newer version.
    """

    def __init__(self, path: Path, *, limit_bytes: int = 1_000_000, keep: int = 50) -> None:
        """Open or make the file.

        Args:
            path: the file; its directory is made.
            limit_bytes: size from which on old transactions are dropped.
            keep: closed transactions and diagnoses kept then.  Open ones, and of each
                accelerometer the first completed push (what calibrating was good for) and the
                last (what a roll-back takes back), with the way back from it, are always kept.
        """
        self._path = path
        self._limit = limit_bytes
        self._keep = keep
        self._lines: list[tuple[float, Entry]] = []
        self._owed: list[tuple[float, Entry]] = []
        self._last: dict[int, list[Planned]] = {}
        self._others: frozenset[str] | None = None
        self._undone: dict[int, Planned] | None = None
        self._encoder = msgspec.json.Encoder()
        self._decoder = msgspec.json.Decoder(Entry)
        self.damaged = 0
        self.appended = 0
        """Entries since it was opened: the last ones."""
        self.trouble = ""
        self.read = self._closed = False
        self._file = JournalFile(path)
        try:
            self._begin()
        except BaseException:
            self.close()
            raise

    def _begin(self) -> None:
        """Open the file; one on a disk in trouble is read, if it can be."""
        try:
            self._open()
        except DiskError as error:
            self.trouble = str(error)
            with contextlib.suppress(DiskError):
                self._load(self._file.look())

    def _open(self) -> None:
        lines = self._file.open()
        try:
            self._load(lines)
        except StateError:
            self._file.close()
            raise
        if self._file.size > self._limit and not self._owed:
            self._compact()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release the file."""
        self._closed = True
        self._file.close()

    @property
    def entries(self) -> tuple[tuple[float, Entry], ...]:
        """All entries with their Unix time, oldest first."""
        return tuple(self._lines)

    def append(self, entry: Entry, at: float) -> None:
        """Write an entry; it is on the disk when this returns.

        Raises:
            StateError: it could not be written (disk full, ...): nothing may be sent that
                relies on it.
        """
        self._write([*self._owed, (at, entry)])
        self._lines.append((at, entry))
        self.appended += 1
        self._changed()
        if self._file.size > self._limit and isinstance(entry, Closed | _REMARKS):
            self._compact()

    def owe(self, entry: Entry, at: float) -> bool:
        """Have an entry that the disk has not taken hold all the same, and written when it does.

        Returns:
            False if it is one of a transaction: those are on the disk, or are not.
        """
        if not isinstance(entry, _REMARKS):
            return False
        self._owed.append((at, entry))
        self._lines.append((at, entry))
        self.appended += 1
        self._changed()
        return True

    def settle(self) -> None:
        """Write what is owed, if the disk has room for a transaction again.

        Raises:
            StateError: it has not.
        """
        self._write(self._owed, room=True)

    def _write(self, lines: Iterable[tuple[float, Entry]], *, room: bool = False) -> None:
        """Put these into the file, on whose trouble that decides.

        Raises:
            StateError: the disk does not take them.
        """
        lines = tuple(lines)
        if self._closed:
            raise StateError(f"{self._path}: closed")
        try:
            if not self._file.writable:
                self._open()
            if room:
                self._file.has_room()
            if lines:
                self._file.append(b"".join(self._line(entry, at) for at, entry in lines))
        except StateError as error:
            self.trouble = str(error)
            raise
        self.trouble = ""
        self._owed.clear()

    def recover(self) -> tuple[Recovery, ...]:
        """The transactions that are open, oldest first: each is to be resumed.

        Raises:
            StateError: one of them has lost its plan.
        """
        return tuple(self._recovery(name) for name in self._open_transactions())

    def last_completed(self, imu: int) -> Planned | None:
        """The push of this accelerometer that is in force: what a roll-back takes back.

        None if there is none, or it was rolled back already.
        """
        last = self.last_written(imu)
        return last if last is not None and last.purpose is Purpose.PUSH else None

    def last_written(self, imu: int) -> Planned | None:
        """What put this accelerometer's values there: the push in force, or the way back from it.

        None if nothing did, or it did not last.
        """
        written = self._written(imu)
        return written[-1] if written else None

    def _written(self, imu: int) -> list[Planned]:
        """:meth:`_gathered`, which is asked for every second, from the lines as they are."""
        if imu not in self._last:
            self._last[imu] = self._gathered(imu)
        return self._last[imu]

    def _changed(self) -> None:
        self._last.clear()
        self._others = self._undone = None

    def _gathered(self, imu: int) -> list[Planned]:
        """The last push that was completed, and the way back from it if there was one.

        Of either nothing is left once it has come to another end: an audit found that it did not
        last.  Of a way back that did not, the push is in force again.
        """
        plans = self._plans()
        written: list[Planned] = []
        for _, entry in self._lines:
            if not isinstance(entry, Closed):
                continue
            planned = plans.get(entry.transaction)
            if planned is None or planned.plan.imu != imu:
                continue
            if entry.result is not Result.COMPLETED:
                if written and written[-1].transaction == entry.transaction:
                    written.pop()
            elif planned.purpose is Purpose.PUSH:
                written = [planned]
            else:
                written = [*(p for p in written if p.purpose is Purpose.PUSH), planned]
        return written

    def last_pushed(self, imu: int) -> Planned | None:
        """The last push that was completed, also where it was rolled back since."""
        return next((p for p in self._written(imu) if p.purpose is Purpose.PUSH), None)

    def last_undone(self, imu: int) -> Planned | None:
        """The last push of this accelerometer, if it was rolled back before it was completed."""
        if self._undone is None:
            plans, self._undone = self._plans(), {}
            for _, entry in self._lines:
                planned = plans.get(entry.transaction) if isinstance(entry, Closed) else None
                if planned is None or not isinstance(entry, Closed):
                    continue
                if entry.result is Result.COMPLETED:
                    self._undone.pop(planned.plan.imu, None)
                elif entry.result is Result.ROLLED_BACK and planned.purpose is Purpose.PUSH:
                    self._undone[planned.plan.imu] = planned
        return self._undone.get(imu)

    def replaced(self) -> frozenset[str]:
        """Transactions whose values are others now, as was seen or as a flight has told."""
        if self._others is None:
            self._others = frozenset(
                e.transaction
                for _, e in self._lines
                if isinstance(e, Replaced)
                or (isinstance(e, Watched) and e.verdict is Verdict.SUPERSEDED)
            )
        return self._others

    def refusals(self) -> dict[int, str]:
        """Accelerometers that are held back until a person approves, and why."""
        last = {e.imu: e.sentence for _, e in self._lines if isinstance(e, Refused)}
        return {imu: sentence for imu, sentence in last.items() if sentence}

    def _plans(self) -> dict[str, Planned]:
        return {e.transaction: e for _, e in self._lines if isinstance(e, Planned)}

    def _first_completed(self) -> Iterable[str]:
        """The first push of each accelerometer that was completed."""
        plans = self._plans()
        first: dict[int, str] = {}
        for _, entry in self._lines:
            if isinstance(entry, Closed) and entry.result is Result.COMPLETED:
                planned = plans.get(entry.transaction)
                if planned is not None and planned.purpose is Purpose.PUSH:
                    first.setdefault(planned.plan.imu, entry.transaction)
        return first.values()

    def _open_transactions(self) -> list[str]:
        order: dict[str, None] = {}
        for _, entry in self._lines:
            if isinstance(entry, Closed):
                order.pop(entry.transaction, None)
            elif not isinstance(entry, _REMARKS):
                order.setdefault(entry.transaction)
        return list(order)

    def _recovery(self, transaction: str) -> Recovery:
        planned = self._plans().get(transaction)
        if planned is None:
            raise StateError(
                f"{self._path}: transaction {transaction} is open but its plan is damaged; "
                "compare the autopilot's INS_ACC* parameters with a backup"
            )
        own = [e for _, e in self._lines if e.transaction == transaction]
        wanted = planned.plan.wanted
        return Recovery(
            transaction=transaction,
            plan=planned.plan,
            purpose=planned.purpose,
            undo=any(isinstance(e, Undoing) for e in own),
            confirmed=frozenset(
                e.name
                for e in own
                if isinstance(e, ReadBack) and e.saved and e.value == wanted.get(e.name)
            ),
        )

    def _load(self, whole: bytes) -> None:
        self.damaged, self._lines = 0, []
        for number, line in enumerate(whole.split(b"\n") if whole else [], start=1):
            try:
                if len(line) > LONGEST_LINE:
                    self.damaged += 1
                    continue
                record = msgspec.json.decode(line, type=Line)
                if record.schema > SCHEMA:
                    raise StateError(f"{self._path}: line {number} is of a newer version")
                if crc32(bytes(record.entry)) != record.check:
                    self.damaged += 1
                    continue
                self._lines.append((record.at, self._decoder.decode(record.entry)))
            except (msgspec.DecodeError, ValueError, RecursionError, PushError):
                # ValueError: text that is not UTF-8, a number with too many digits.
                self.damaged += 1
        self._lines += self._owed
        self.read = True
        self._changed()

    def _line(self, entry: Entry, at: float) -> bytes:
        body = self._encoder.encode(entry)
        line = Line(SCHEMA, at, crc32(body), msgspec.Raw(body))
        return self._encoder.encode(line) + b"\n"

    def _compact(self) -> None:
        """Rewrite the file with what is still needed; on failure the old file stays in use."""
        keep = set(self._open_transactions())
        for imu in range(1, 6):
            # A way back, too: without it the push that it took back would be in force again.
            keep.update(planned.transaction for planned in self._written(imu))
        keep.update(self._first_completed())
        said = {e.imu: e.transaction for _, e in self._lines if isinstance(e, Refused)}
        keep.update(said.values())
        closed = [e.transaction for _, e in self._lines if isinstance(e, Closed | Found)]
        keep.update(closed[max(0, len(closed) - self._keep) :])
        lines = [(at, e) for at, e in self._lines if e.transaction in keep]
        if len(lines) == len(self._lines) and not self.damaged:
            return
        if self._file.replace(b"".join(self._line(entry, at) for at, entry in lines)):
            self._lines, self.damaged = lines, 0
            self._changed()
