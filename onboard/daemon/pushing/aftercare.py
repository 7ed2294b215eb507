"""Aftercare: whether the values that were written are still there, and what follows where not.

One principle: **nothing is written over what was not left here, unless a transaction of our own was
open.**  Values that are others now have come there in one of four ways:

* *Somebody has set them.*  That was seen on the wire; or they have changed while nothing was heard,
  and the autopilot has not rebooted meanwhile: without that no value is lost.  They are theirs from
  then on, which the journal keeps, and nobody looks any more whether ours last.
* *The autopilot had not stored them.*  All were there, it rebooted before our eyes, and some are
  those of before.  That is a transaction which has not come to its end, and is undone.
* *Nobody can tell*: the service was not there, or the autopilot fell silent and rebooted, and some
  are those of before.  That is said, and a person may have the others put back.
* *All are those of before.*  Nothing is left to be put back: that is only written down.

And values that were put back may be new again: a line can hold a write for longer than anybody
waits for it, and give it to the autopilot when its transaction has long been closed.  Half a set is
in force then.  That is said, and a person may have it put back.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping

from onboard.daemon.pushing import limits
from onboard.daemon.pushing.ledger import IMUS, Ledger
from onboard.daemon.view.notices import Notices
from onboard.push.entries import (
    NOT_STORED,
    Closed,
    Planned,
    Purpose,
    Recovery,
    Remains,
    Replaced,
    Result,
    audit,
    remains,
)
from onboard.push.signals import Reason

ASKED = "a person had it put back"


class Aftercare:
    """Looks after what was written last to each accelerometer.

    Args:
        ledger: what that is.
        notices: where what was found goes.
    """

    def __init__(self, ledger: Ledger, notices: Notices) -> None:
        self.lost: dict[int, Recovery] = {}
        """What the autopilot had not stored, by accelerometer: to be taken up."""
        self._mixed: dict[int, Recovery] = {}
        self._late: dict[int, Recovery] = {}
        self._late_looks: Counter[int] = Counter()
        self._ledger = ledger
        self._notices = notices
        self._seen: dict[int, str] = {}
        self._looked: set[int] = set()
        self._rebooted = self._silent = False

    @property
    def mixed(self) -> Mapping[int, Recovery]:
        """Accelerometers with old and new values, nobody knows why, and their way back."""
        return self._mixed

    @property
    def asked(self) -> dict[int, Recovery]:
        """All of which a person decides: those, and writes that came when they were taken back."""
        return {**self._mixed, **self._late}

    # What happens to the autopilot

    def begin(self) -> None:
        """It is there (again): what it has is to be read anew."""
        self._looked.clear()
        self.lost.clear()

    def silent(self) -> None:
        """From here on nobody sees what happens to it."""
        self._silent = True

    def rebooted(self, values: Mapping[str, float], *, busy: bool) -> None:
        """It has: what it had told before that, others had set.

        Args:
            values: its parameters by name, as it had told them.
            busy: a transaction is under way, which changes them.
        """
        if not busy:
            self._look_again(values)
        self._rebooted = True

    def another(self) -> None:
        """Another board is there, for all that is known."""
        self._seen.clear()
        self._mixed.clear()
        self._late.clear()

    def wrote(self, imu: int, transaction: str) -> None:
        """A transaction has just read back what it had written."""
        self._looked.add(imu)
        self._seen[imu] = transaction
        self._mixed.pop(imu, None)

    def undone(self, imu: int) -> None:
        """A transaction has just read back what had been in force before it."""
        self._mixed.pop(imu, None)
        self._late.pop(imu, None)

    # Looking

    def look(
        self, values: Mapping[str, float], confirmed: Collection[str], *, unasked: bool
    ) -> None:
        """Compare what was written last with what is there; not while a transaction is under way.

        Args:
            values: the autopilot's parameters by name.
            confirmed: names whose values were read since it was there again.
            unasked: whether anything may be written that no person has approved.
        """
        names = set(confirmed)
        self._look_for_late(values, names)
        self._look_again(values)
        left = self._left()
        for imu in self._mixed.keys() - left.keys():
            del self._mixed[imu]
        all_read = True
        for imu, written in left.items():
            if imu in self._looked:
                continue
            found = remains(written.plan, values) if names.issuperset(written.plan.names) else None
            if found is None:
                all_read = False
                continue
            self._looked.add(imu)
            self._ledger.counters["audits"] += 1
            self._first_look(imu, written, found, values, unasked=unasked)
        if all_read:
            self._rebooted = self._silent = False

    def _left(self) -> dict[int, Planned]:
        """What was written last and is ours, but for what came late over it."""
        left = self._ledger.left()
        return {imu: written for imu, written in left.items() if not self._late_looks[imu]}

    def _look_for_late(self, values: Mapping[str, float], names: Collection[str]) -> None:
        """Whether something of a push that was rolled back is in force again."""
        for imu in IMUS:
            undone = self._ledger.last_undone(imu)
            known = undone is not None and set(undone.plan.names) <= set(names)
            found = remains(undone.plan, values) if undone is not None and known else None
            if undone is None or found is not Remains.MIXED:
                self._late_looks[imu] = 0
                self._late.pop(imu, None)
                continue
            self._late_looks[imu] += 1
            if self._late_looks[imu] == limits.LATE_LOOKS:
                self._late[imu] = Recovery.undoing(undone, ASKED)
                again = [c.name for c in undone.plan.changes if values[c.name] != c.before]
                text = (
                    f"IMU {imu}: {', '.join(again)} as in a write that was taken back: a late copy "
                    f"of it, or set by somebody; `onboard rollback {imu}` puts the old values back"
                )
                self._notices.post("push_late", text, warning=True)

    def _look_again(self, values: Mapping[str, float]) -> None:
        """What has changed while the autopilot was listened to, somebody has changed."""
        for imu, written in self._left().items():
            found = remains(written.plan, values) if imu in self._looked else None
            if found is Remains.WHOLE:
                self._there(imu, written)
            elif found is None or (imu in self.lost and found is not Remains.OTHERS):
                continue
            elif found is not Remains.MIXED or imu not in self._mixed:
                self._theirs(imu, written, values)

    def _first_look(
        self,
        imu: int,
        written: Planned,
        found: Remains,
        values: Mapping[str, float],
        *,
        unasked: bool,
    ) -> None:
        """After a start of the service, a silence or a boot of the autopilot."""
        seen = self._seen.get(imu) == written.transaction
        before_our_eyes = seen and self._rebooted and not self._silent
        if found is Remains.WHOLE:
            self._there(imu, written)
            if written.purpose is Purpose.PUSH:
                text = f"IMU {imu}: the autopilot has the values of the last push"
                self._notices.post("push_stored", text)
        elif found is Remains.OTHERS or (seen and not self._rebooted):
            self._theirs(imu, written, values)
        elif found is Remains.GONE:
            self._all_gone(imu, written, values, stored=not (before_our_eyes and unasked))
        elif before_our_eyes and unasked:
            self._not_stored(imu, written, values)
        else:
            self._ask(imu)

    def _there(self, imu: int, written: Planned) -> None:
        self._seen[imu] = written.transaction
        self._mixed.pop(imu, None)
        self.lost.pop(imu, None)

    def _theirs(self, imu: int, written: Planned, values: Mapping[str, float]) -> None:
        """Somebody has set values: theirs stay."""
        changed = [c.name for c in written.plan.changes if values[c.name] != c.wanted]
        sentence = f"somebody has changed {', '.join(changed)}"
        self._ledger.append(Replaced(written.transaction, sentence))
        self._mixed.pop(imu, None)
        self.lost.pop(imu, None)
        half = remains(written.plan, values) is Remains.MIXED
        told = f"{sentence}: that stays" + ("; the others are as they were written" if half else "")
        self._notices.post("push_replaced", f"IMU {imu}: {told}", warning=half)

    def _not_stored(self, imu: int, written: Planned, values: Mapping[str, float]) -> None:
        """Back to the old ones, whether they were to go or to come back."""
        pushed = self._ledger.last_pushed(imu)
        if written.purpose is Purpose.PUSH or pushed is None:
            recovery = audit(written, values)
            text = f"IMU {imu}: values that were written are gone: the push is taken back"
            self._notices.post("push_not_stored", text, warning=True)
        else:
            recovery = audit(pushed, values)
            text = f"IMU {imu}: values that were rolled back are there again"
            self._notices.post("roll_back_not_stored", text, warning=True)
        if recovery is not None:
            self.lost[imu] = recovery

    def _all_gone(
        self, imu: int, written: Planned, values: Mapping[str, float], *, stored: bool
    ) -> None:
        """Nothing is left of it.  Of a way back that was not ``stored`` the push is in force."""
        if written.purpose is Purpose.PUSH:
            text = f"IMU {imu}: the autopilot has the values from before the last push again"
            self._notices.post("push_gone", text, warning=True)
        else:
            text = f"IMU {imu}: values that were rolled back are there again"
            self._notices.post("roll_back_not_stored", text, warning=True)
        if stored:
            sentence = "the values from before it are there again"
            self._ledger.append(Replaced(written.transaction, sentence))
            return
        six = {name: values[name] for name in written.plan.names}
        result, reason = Result.ROLLED_BACK, Reason.REVERTED.value
        self._ledger.append(Closed(written.transaction, result, reason, NOT_STORED, six))

    def _ask(self, imu: int) -> None:
        """Old and new values: lost, or somebody's will."""
        pushed = self._ledger.last_pushed(imu)
        if pushed is None or imu in self._mixed:  # that was said
            return
        self._mixed[imu] = Recovery.undoing(pushed, ASKED)
        text = (
            f"IMU {imu}: some values are those from before the last push, lost or set by somebody; "
            f"`onboard rollback {imu}` puts the others back, too"
        )
        self._notices.post("push_mixed", text, warning=True)
