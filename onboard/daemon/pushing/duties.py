"""Duties: what earlier transactions still ask for, from the ledger to those who have to know."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.view.notices import Notices
from onboard.push.entries import Planned, Purpose, Recovery, Result, Verdict, Watched
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
        self._ledger = ledger
        self._proposals = proposals
        self._witness = witness
        self._notices = notices
        self._to_audit = False

    @property
    def unfinished(self) -> bool:
        """Whether transactions are open that have to be taken up.

        One that turned out to be of another vehicle waits for that one, and nothing waits for it.
        """
        return any(self.not_before.get(r.transaction) != math.inf for r in self._ledger.open)

    def begin(self) -> None:
        """An autopilot is there (again): pauses are over, and pushes have to show."""
        self.not_before.clear()
        self._to_audit = True

    def read(self, *, busy: bool, in_flight_since: float | None) -> None:
        """What the journal asks for: to be resumed, a verdict, or the way back.

        Args:
            busy: a transaction is under way, which is open and in good hands.
            in_flight_since: when the last push was written, if the vehicle was flying.
        """
        if not busy:
            self._ledger.read_open()
        for imu, planned, verdict in self._ledger.judged():
            if planned is not None and verdict is None:
                self._witness.watch(planned, in_flight_since=in_flight_since)
                continue
            self._witness.drop(imu)
            if verdict is not None and verdict.verdict is Verdict.WORSE:
                self._proposals.refuse(imu, f"after the last push {verdict.sentence}")

    def judge(self, verdicts: Sequence[Watched]) -> bool:
        """Write down and tell what flights say of pushes; whether any did."""
        for verdict in verdicts:
            self._ledger.append(verdict)
            self._ledger.counters[f"verdict_{verdict.verdict.value}"] += 1
            self._notices.post(
                f"push_{verdict.verdict.value}",
                f"the flight after the push: {verdict.sentence}",
                warning=verdict.verdict is Verdict.WORSE,
            )
        return bool(verdicts)

    def audit(self, values: Mapping[str, float], confirmed: Collection[str]) -> None:
        """Once after each start of the autopilot: whether what was written is still there.

        Of a way back that is gone the push is in force again: if a flight found it worse, it is
        taken back anew, else a person may.

        Args:
            values: the autopilot's parameters by name.
            confirmed: names whose values were read since it was there again.
        """
        if not self._to_audit or self.unfinished:
            return
        self._to_audit = False
        for planned, recovery in self._ledger.audited(values, confirmed):
            imu, pushed = planned.plan.imu, planned.purpose is Purpose.PUSH
            if recovery is not None and pushed:
                text = f"IMU {imu}: values that were written are gone: the push is taken back"
                self._notices.post("push_not_stored", text, warning=True)
            elif recovery is not None:
                text = f"IMU {imu}: values that were rolled back are there again"
                self._notices.post("roll_back_not_stored", text, warning=True)
            elif pushed:
                text = f"IMU {imu}: the autopilot has the values of the last push"
                self._notices.post("push_stored", text)

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
        return None

    def take_back(self, now: float) -> Planned | None:
        """The first push that a flight found worse, unless it was tried in vain just now."""
        if not self._ledger.condemned:
            return None
        imu, planned = next(iter(self._ledger.condemned.items()))
        return planned if now >= self._proposals.standing(imu).not_before else None

    @property
    def condemned(self) -> bool:
        """Whether a push in force has to be taken back."""
        return bool(self._ledger.condemned)

    def ended(self, outcome: Outcome) -> None:
        """What the end of a transaction leaves to be done."""
        imu = outcome.plan.imu
        if outcome.open:  # once more after a pause; of another vehicle when one turns up anew
            other = outcome.result is Result.OTHER_VEHICLE
            pause_ends = self._proposals.standing(imu).not_before
            self.not_before[outcome.transaction] = math.inf if other else pause_ends
        if outcome.reason is Reason.RESTARTED:
            self._to_audit = True  # one audit may have found more than one accelerometer
        condemned = self._ledger.condemned.get(imu)
        if condemned is not None and outcome.reason is Reason.CHANGED_BY_OTHER:
            sentence = "not taken back: somebody has changed the parameters since"
            self._ledger.append(Watched(condemned.transaction, Verdict.SUPERSEDED, sentence))
