"""The ledger: what the journal says of pushes on the board that is there.

Transactions that a crash left open have to be taken up, pushes that made a flight worse have to be
taken back, others still wait for the flight that judges them.  All of that is read from the journal
anew whenever it may have changed, so that nothing is remembered in two places.
"""

from __future__ import annotations

import logging
import uuid
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping

from onboard.errors import StateError
from onboard.push.entries import Entry, Planned, Recovery, Refused, Verdict, Watched, audit
from onboard.push.journal import Journal
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
        self._journal = journal
        self._wall_clock = wall_clock

    @property
    def entries(self) -> tuple[tuple[float, Entry], ...]:
        """All entries with their Unix time, oldest first."""
        return self._journal.entries

    def append(self, entry: Entry) -> JournalWritten | JournalFailed:
        """Write to the journal; a disk that does not take it is counted and logged."""
        try:
            self._journal.append(entry, self._wall_clock())
        except StateError as error:
            self.counters["journal_failed"] += 1
            logger.error("%s", error)  # noqa: TRY400 - a full disk is no bug of ours
            return JournalFailed(str(error))
        return JournalWritten()

    def refused(self, imu: int, why: str) -> None:
        """Remember a refusal, or its end: a restart must not write what was refused."""
        self.append(Refused(uuid.uuid4().hex, imu, why))

    def refusals(self) -> dict[int, str]:
        """What is refused, by accelerometer, and why."""
        return self._journal.refusals()

    def in_force(self, imu: int) -> Planned | None:
        """The push that is in force on the board that is there, as far as it tells which it is."""
        return self._here(self._journal.last_completed(imu))

    def _here(self, planned: Planned | None) -> Planned | None:
        """It, if it was written to the board that is there."""
        if planned is None or self.system_id is None:
            return planned
        here = planned.plan.vehicle.same_airframe(self.system_id, self.board)
        return planned if here else None

    def all_in_force(self) -> dict[int, Planned]:
        """:meth:`in_force` of every accelerometer that has one."""
        return {imu: planned for imu in IMUS if (planned := self.in_force(imu)) is not None}

    def read_open(self) -> None:
        """Look for transactions that a crash, or trouble, has left open.

        Raises:
            StateError: one of them has lost its plan.
        """
        self.open = list(self._journal.recover())

    def judged(self) -> Iterator[tuple[int, Planned | None, Watched | None]]:
        """Every accelerometer, its push in force and its verdict; condemned ones are kept."""
        verdicts = {e.transaction: e for _, e in self.entries if isinstance(e, Watched)}
        self.condemned.clear()
        for imu in IMUS:
            planned = self.in_force(imu)
            verdict = None if planned is None else verdicts.get(planned.transaction)
            if planned is not None and verdict is not None and verdict.verdict is Verdict.WORSE:
                self.condemned[imu] = planned
            yield imu, planned, verdict

    def audited(
        self, values: Mapping[str, float], confirmed: Collection[str]
    ) -> Iterator[tuple[Planned, Recovery | None]]:
        """Whether what was written is still there, now that the autopilot has (perhaps) rebooted.

        That is a push, or the way back from one, which has to last no less.

        Args:
            values: the autopilot's parameters by name.
            confirmed: names whose values were read since it was there again.

        Yields:
            What was written and is still there (with None), or is gone (with what has to be
            taken up, which is from then on open); those of which neither can be said are left out.
        """
        names = set(confirmed)
        for imu in IMUS:
            planned = self._here(self._journal.last_written(imu))
            if planned is None or not planned.plan.wanted.keys() <= names:
                continue
            wanted = planned.plan.wanted
            self.counters["audits"] += 1
            recovery = audit(planned, values)
            if recovery is not None:
                self.open.append(recovery)
                yield planned, recovery
            elif all(values[name] == value for name, value in wanted.items()):
                yield planned, None
