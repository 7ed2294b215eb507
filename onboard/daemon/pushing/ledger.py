"""The ledger: what the journal says of pushes on the board that is there.

Transactions that a crash left open have to be taken up, pushes that made a flight worse have to be
taken back, others still wait for the flight that judges them.  All of that is read from the journal
anew whenever it may have changed, so that nothing is remembered in two places.
"""

from __future__ import annotations

import logging
import math
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Mapping

from onboard.daemon.pushing import limits
from onboard.errors import StateError
from onboard.push.entries import (
    Entry,
    Planned,
    ReadBack,
    Recovery,
    Refused,
    Remains,
    Verdict,
    Watched,
    Writing,
    remains,
)
from onboard.push.journal import Journal
from onboard.push.plan import PushPlan
from onboard.push.signals import JournalFailed, JournalWritten

logger = logging.getLogger(__name__)

IMUS = range(1, 6)


class Ledger:
    """The journal with its clock, for one board at a time.

    Args:
        journal: the disk.
        wall_clock: Unix time, s.
    """

    def __init__(self, journal: Journal, wall_clock: Callable[[], float]) -> None:
        self.counters: Counter[str] = Counter()
        self.system_id: int | None = None
        self.board = ""
        self.open: list[Recovery] = []
        """Transactions that have to be taken up."""
        self.condemned: dict[int, Planned] = {}
        """Pushes in force that a flight found worse, by accelerometer."""
        self.mended = 0
        """How often the disk took the journal again."""
        self._journal = journal
        self._wall_clock = wall_clock
        self._try_at = -math.inf

    @property
    def trouble(self) -> str:
        """Why nothing can be written down, and so no transaction begins; empty: it can."""
        why = self._journal.trouble
        return f"the disk does not take the journal ({why})" if why else ""

    def tend(self, now: float, *, doubted: bool) -> None:
        """See now and then whether a disk in trouble takes the journal again.

        Args:
            now: monotonic, s.
            doubted: the disk has not taken something else: does it take the journal?
        """
        before = self._journal.trouble
        if now < self._try_at or not (before or doubted):
            return
        self._try_at = now + limits.DISK_TRIED_S
        try:
            self._journal.settle()
        except StateError as error:
            if not before:
                logger.error("%s", error)  # noqa: TRY400 - a full disk is no bug of ours
            return
        if before:
            self.mended += 1

    @property
    def entries(self) -> tuple[tuple[float, Entry], ...]:
        """All entries with their Unix time, oldest first."""
        return self._journal.entries

    def append(self, entry: Entry) -> JournalWritten | JournalFailed:
        """Write to the journal; a disk that does not take it is counted and logged.

        What a flight or a person says, and no transaction, is owed to it: it holds all the same.
        """
        at, before = self._wall_clock(), self._journal.trouble
        try:
            self._journal.append(entry, at)
        except StateError as error:
            self.counters["journal_failed"] += 1
            if not before:
                logger.error("%s", error)  # noqa: TRY400 - a full disk is no bug of ours
            self._journal.owe(entry, at)
            return JournalFailed(str(error))
        if before:
            self.mended += 1
        return JournalWritten()

    def refused(self, imu: int, why: str) -> None:
        """Remember a refusal, or its end: a restart must not write what was refused."""
        self.append(Refused(uuid.uuid4().hex, imu, why))

    def refusals(self) -> dict[int, str]:
        """What is refused, by accelerometer, and why."""
        return self._journal.refusals()

    def in_force(self, imu: int) -> Planned | None:
        """The push that the journal has as in force on the board that is there."""
        return self._here(self._journal.last_completed(imu))

    def _here(self, planned: Planned | None) -> Planned | None:
        """It, if it was written to the board that is there."""
        return planned if planned is not None and self.is_here(planned.plan) else None

    def is_here(self, plan: PushPlan) -> bool:
        """Whether a plan is for the board that is there, as far as is known."""
        if self.system_id is None:
            return True
        return plan.vehicle.same_airframe(self.system_id, self.board)

    def left(self) -> dict[int, Planned]:
        """What was written last to each accelerometer, a push or the way back, and is still ours.

        It is not any more once somebody else has set values, as was seen or a flight has told.
        """
        theirs = self._journal.replaced()
        written = {imu: self._here(self._journal.last_written(imu)) for imu in IMUS}
        return {
            imu: planned
            for imu, planned in written.items()
            if planned is not None and planned.transaction not in theirs
        }

    def last_pushed(self, imu: int) -> Planned | None:
        """The last push that was completed on the board that is there, rolled back or not."""
        return self._here(self._journal.last_pushed(imu))

    def last_undone(self, imu: int) -> Planned | None:
        """The last push of the board that is there, if it was rolled back before it completed."""
        return self._here(self._journal.last_undone(imu))

    def unanswered(self, transaction: str) -> frozenset[str]:
        """Names that it has written, and not read back since."""
        names: set[str] = set()
        for _, entry in self.entries:
            if isinstance(entry, Writing) and entry.transaction == transaction:
                names.add(entry.name)
            elif isinstance(entry, ReadBack) and entry.transaction == transaction:
                names.discard(entry.name)
        return frozenset(names)

    def all_in_force(
        self, values: Mapping[str, float], writing: int | None = None
    ) -> dict[int, Planned]:
        """The last push of every accelerometer that has the values that were pushed.

        That is what a roll-back would take back.  Where the values are not known, or are changing,
        it is :meth:`in_force`, as the journal has it.

        Args:
            values: the autopilot's parameters by name.
            writing: accelerometer of the transaction under way.
        """
        found = {}
        for imu in IMUS:
            pushed = self.last_pushed(imu)
            left = None if pushed is None or imu == writing else remains(pushed.plan, values)
            if left is None:
                pushed = self.in_force(imu)
            if pushed is not None and left in {None, Remains.WHOLE}:
                found[imu] = pushed
        return found

    def read_open(self) -> None:
        """Look for transactions that a crash, or trouble, has left open.

        Raises:
            StateError: one of them has lost its plan.
        """
        self.open = list(self._journal.recover())

    def judged(self) -> Iterator[tuple[int, Planned | None, Watched | None]]:
        """Every accelerometer, its push in force and its verdict; condemned ones are kept."""
        verdicts = {e.transaction: e for _, e in self.entries if isinstance(e, Watched)}
        replaced = self._journal.replaced()
        self.condemned.clear()
        for imu in IMUS:
            planned = self.in_force(imu)
            verdict = None if planned is None else verdicts.get(planned.transaction)
            worse = verdict is not None and verdict.verdict is Verdict.WORSE
            if planned is not None and worse and planned.transaction not in replaced:
                self.condemned[imu] = planned
            yield imu, planned, verdict
