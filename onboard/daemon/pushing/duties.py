"""Duties: what earlier transactions still ask for, from the ledger to those who have to know."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from onboard.daemon.pushing import limits
from onboard.daemon.pushing.aftercare import Aftercare
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import UnfinishedView
from onboard.daemon.view.unfinished import Unfinished, unfinished_view
from onboard.push.entries import Planned, Recovery, Result, Verdict, Watched
from onboard.push.policy import Mode, VehicleCondition, moment
from onboard.push.signals import Outcome, Reason


class Duties:
    """To be resumed, judged by a flight, taken back, or looked after; ``now`` is monotonic.

    Args:
        ledger: what is known of earlier transactions.
        proposals: hold back what a flight found worse.
        witness: waits for the flights that judge.
        notices: where what was found goes.
    """

    def __init__(
        self, ledger: Ledger, proposals: Proposals, witness: Witness, notices: Notices
    ) -> None:
        self.not_before: dict[str, float] = {}
        """End of the pause of an open transaction, by its identifier."""
        self.aftercare = Aftercare(ledger, notices)
        self._waits: dict[str, str] = {}
        self._tries: Counter[str] = Counter()
        self._until_right: dict[str, float] = {}
        self._left_at: dict[str, float] = {}
        self._ledger = ledger
        self._proposals = proposals
        self._witness = witness
        self._notices = notices

    @property
    def unfinished(self) -> bool:
        """Whether transactions are open, or did not last, that have to be taken up.

        One that turned out to be of another vehicle waits for that one, and nothing waits for it.
        """
        return self._open or bool(self.aftercare.lost)

    @property
    def _open(self) -> bool:
        return any(self.not_before.get(r.transaction) != math.inf for r in self._ledger.open)

    def not_ended(
        self, there: Mapping[str, float], heard: Mapping[str, float], condition: VehicleCondition
    ) -> tuple[UnfinishedView, ...]:
        """What of the vehicle that is there is to be taken up, or waits for a person.

        Args:
            there: the autopilot's parameters by name, those that were read since it is there.
            heard: when each was told last, monotonic, s.
            condition: the vehicle now.
        """
        hindered = self._proposals.forbidden or self._ledger.trouble
        return tuple(
            unfinished_view(one, there, condition, heard=heard, hindered=hindered)
            for one in self._not_ended()
        )

    def _not_ended(self) -> list[Unfinished]:
        mine = [r for r in self._ledger.open if self._ledger.is_here(r.plan)]
        found = [
            Unfinished(
                recovery=r,
                waits=self._waits.get(r.transaction, ""),
                unanswered=self._ledger.unanswered(r.transaction),
                since=self._left_at.get(r.transaction, -math.inf),
            )
            for r in mine
        ]
        found += [Unfinished(recovery=r) for r in self.aftercare.lost.values()]
        return found + [Unfinished(recovery=r, asks=True) for r in self.aftercare.asked.values()]

    def mended(self) -> None:
        """The disk takes the journal again: what waited for that waits no longer."""
        self.not_before.clear()

    def begin(self) -> None:
        """An autopilot is there (again): pauses are over, and pushes have to show."""
        self.not_before.clear()
        self._tries.clear()
        self._until_right.clear()
        self.aftercare.begin()

    def read(self, *, busy: bool, in_flight_since: float | None) -> None:
        """What the journal asks for: to be resumed, a verdict, or the way back.

        Args:
            busy: a transaction is under way, which is open and in good hands.
            in_flight_since: when the last push was written, if the vehicle was flying.
        """
        if not busy:
            self._ledger.read_open()
        for imu, planned, verdict in self._ledger.judged():
            doubted = verdict is not None and verdict.verdict is Verdict.DOUBTED
            if planned is not None and (verdict is None or doubted):
                self._witness.watch(planned, in_flight_since=in_flight_since)
                continue
            self._witness.drop(imu)
            if verdict is not None and imu in self._ledger.condemned:
                self._proposals.refuse(imu, f"after the last push {verdict.sentence}")

    def judge(self, verdicts: Sequence[Watched]) -> bool:
        """Write down and tell what flights say of pushes; whether any did."""
        for verdict in verdicts:
            self._ledger.append(verdict)
            self._ledger.counters[f"verdict_{verdict.verdict.value}"] += 1
            self._notices.post(
                f"push_{verdict.verdict.value}",
                f"the flight after the push: {verdict.sentence}",
                warning=verdict.verdict in {Verdict.WORSE, Verdict.DOUBTED},
            )
        return bool(verdicts)

    def look(self, values: Mapping[str, float], confirmed: Collection[str]) -> bool:
        """See whether what was written is still there; whether anything was written down of it.

        What is open is still on its way.

        Args:
            values: the autopilot's parameters by name.
            confirmed: names whose values were read since it was there again.
        """
        if self._open:
            return False
        for recovery in self._ledger.open:
            self._right_again(recovery, values)
        unasked = self._proposals.settings.mode is not Mode.NEVER and not self._proposals.approval
        known = len(self._ledger.entries)
        self.aftercare.look(values, confirmed, unasked=unasked)
        return len(self._ledger.entries) != known

    def _right_again(self, recovery: Recovery, values: Mapping[str, float]) -> None:
        """What waits for its accelerometer waits no longer once the identifier is that one's."""
        name, pause_ends = recovery.transaction, self._until_right.get(recovery.transaction)
        if pause_ends is None or not self._ledger.is_here(recovery.plan):
            return
        if values.get(recovery.plan.device_id_name) == recovery.plan.vehicle.device_id:
            self.not_before[name] = pause_ends
            self._waits[name] = ""
            del self._until_right[name]

    def against(self, condition: VehicleCondition) -> str:
        """Objections to the way back at this moment; the policy 'never' is none."""
        settings = replace(self._proposals.settings, mode=Mode.LANDED)
        return "; ".join(refusal.sentence for refusal in moment(condition, settings))

    def take_up(self, now: float) -> Recovery | None:
        """The first open transaction whose pause is over and whose vehicle may be there."""
        for recovery in self._ledger.open:
            if now >= self.not_before.get(recovery.transaction, now):
                self._ledger.open.remove(recovery)
                return recovery
        if self._ledger.trouble:  # only what is on the disk as open has its way back there
            return None
        lost = self.aftercare.lost
        return lost.pop(next(iter(lost))) if lost else None

    def take_back(self, now: float) -> Planned | None:
        """The first push that a flight found worse, unless it was tried in vain just now."""
        if not self._ledger.condemned or self._ledger.trouble:
            return None
        imu, planned = next(iter(self._ledger.condemned.items()))
        if planned.plan.no_way_back:
            sentence = f"not taken back: before it was {planned.plan.no_way_back}"
            self.judge([Watched(planned.transaction, Verdict.SUPERSEDED, sentence)])
            self._ledger.condemned.pop(imu)
            return None
        return planned if now >= self._proposals.standing(imu).not_before else None

    @property
    def condemned(self) -> bool:
        """Whether a push in force has to be taken back."""
        return bool(self._ledger.condemned)

    def ended(self, outcome: Outcome, now: float) -> None:
        """What the end of a transaction leaves to be done."""
        imu = outcome.plan.imu
        if outcome.open:  # once more after a pause; of another vehicle when one turns up anew
            other = outcome.result is Result.OTHER_VEHICLE
            self._left_at[outcome.transaction] = now
            tries = self._tries[outcome.transaction]
            self._tries[outcome.transaction] += 1
            pauses = limits.RESUMED_AFTER_S
            pause_ends = now + pauses[min(tries, len(pauses) - 1)]
            # While its end cannot be written down, it would be taken up for ever.
            for_good = other or outcome.reason is Reason.NO_WAY_BACK
            waits = for_good or bool(self._ledger.trouble)
            self.not_before[outcome.transaction] = math.inf if waits else pause_ends
            self._waits[outcome.transaction] = outcome.sentence if for_good else ""
            if other:
                self._until_right[outcome.transaction] = pause_ends
        if outcome.result is Result.COMPLETED:
            self.aftercare.wrote(imu, outcome.transaction)
        elif outcome.result is Result.ROLLED_BACK:
            self.aftercare.undone(imu)
        condemned = self._ledger.condemned.get(imu)
        if condemned is not None and outcome.reason is Reason.CHANGED_BY_OTHER:
            sentence = "not taken back: somebody has changed the parameters since"
            self._ledger.append(Watched(condemned.transaction, Verdict.SUPERSEDED, sentence))
