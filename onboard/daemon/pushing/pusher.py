"""The pusher: drives one transaction at a time, and remembers what earlier ones still ask for.

Participant of the link.  The transaction is sans-IO (:mod:`onboard.push.transaction`); here are
its clock, its journal and the decision to start one.  Journal entries are written where the
transaction asks for them, in the loop: the order of writes is what the guarantee rests on, and
a push is six writes after a flight.
"""

from __future__ import annotations

import asyncio
import logging
import math
import uuid
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import msgspec

from onboard.daemon.learning.flight import JudgedFlight
from onboard.daemon.learning.learner import Learned
from onboard.daemon.pushing.proposals import Proposals, named
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import PushView
from onboard.daemon.view.state import WAITING
from onboard.daemon.view.written import written_view
from onboard.errors import RefusedError, StateError
from onboard.mavlink.autopilot import AutopilotRebooted, AutopilotSilent, LinkEvent
from onboard.mavlink.dialect import COMPONENT, Message, mavlink
from onboard.mavlink.parameter_messages import SendAction, parameter_event, parameter_message
from onboard.push.course import TransactionSettings
from onboard.push.entries import (
    Entry,
    Planned,
    Purpose,
    Recovery,
    Refused,
    Result,
    Support,
    Verdict,
    Watched,
    audit,
)
from onboard.push.journal import Journal
from onboard.push.plan import PushPlan
from onboard.push.policy import Mode, VehicleCondition, moment
from onboard.push.signals import (
    Finished,
    JournalFailed,
    JournalWritten,
    LinkLost,
    Outcome,
    Reason,
    Rebooted,
    Record,
    TransactionEvent,
    TransactionOutput,
    VehicleReport,
)
from onboard.push.transaction import PushTransaction

logger = logging.getLogger(__name__)

PATIENCE = TransactionSettings()


class Pusher:
    """One per daemon; ``now`` is a monotonic clock, ``wall_clock`` Unix time for the journal.

    Raises:
        StateError: an open transaction in the journal has lost its plan.
    """

    names = ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")

    def __init__(
        self,
        journal: Journal,
        proposals: Proposals,
        witness: Witness,
        notices: Notices,
        *,
        wall_clock: Callable[[], float],
    ) -> None:
        self.counters: Counter[str] = Counter()
        self.last_outcome: Outcome | None = None
        self._journal = journal
        self._proposals = proposals
        self._witness = witness
        self._notices = notices
        self._wall_clock = wall_clock
        self._codec = mavlink.MAVLink(None)
        self._target: tuple[int, int] | None = None
        self._board = ""
        self._flight: JudgedFlight | None = None
        self._transaction: PushTransaction | None = None
        self._in_flight_since: float | None = None
        self._report = VehicleReport()
        self._condition = VehicleCondition()
        self._outbox: list[Message] = []
        self._recoveries: list[Recovery] = []
        self._condemned: dict[int, Planned] = {}
        self._not_before: dict[str, float] = {}
        self._to_audit = False
        self._closing = False
        self.idle = asyncio.Event()
        self.idle.set()
        proposals.restore(journal.refusals())
        proposals.on_refusal = self._refusal
        self._read_journal()

    @property
    def busy(self) -> bool:
        """Whether a transaction is under way."""
        return self._transaction is not None

    # What the link calls

    def start(self, system: int, component: int, now: float) -> None:  # noqa: ARG002 - the participants' signature
        """An autopilot is there (again): open transactions may be taken up, pushes have to show."""
        self._target = (system, component)
        self._not_before.clear()
        self._to_audit = True
        self._read_journal()

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take the autopilot's word on a parameter."""
        if self._transaction is not None and self._target is not None:
            system, component = self._target
            event = parameter_event(
                message,
                system=system,
                component=component,
                own_system=system,
                own_component=COMPONENT,
            )
            if event is not None:
                self._tell(event, now)
        return self._take_outbox()

    def poll(self, now: float) -> Sequence[Message]:
        """Let time pass for the transaction; messages that are due."""
        if self._transaction is not None:
            deadline = self._transaction.next_deadline()
            if deadline is not None and deadline <= now:
                self._act(self._transaction.tick(now), now)
        return self._take_outbox()

    def on_event(self, now: float, event: LinkEvent) -> None:
        """What happens to the autopilot in the middle of a transaction."""
        match event:
            case AutopilotRebooted():
                self._tell(Rebooted(), now)
            case AutopilotSilent():
                self._tell(LinkLost(), now)
            case _:
                pass

    # What the service's tick calls

    def consider(
        self,
        now: float,
        *,
        learned: Learned,
        parameters: Mapping[str, float],
        condition: VehicleCondition,
        board: str = "",
        confirmed: Collection[str] | None = None,
    ) -> None:
        """Propose anew; start what nothing holds back: unfinished business first.

        Args:
            now: monotonic, s.
            learned: of the autopilot that is there.
            parameters: its values by name.
            condition: the vehicle now.
            board: its unique id, empty if it tells none.
            confirmed: names whose values were read since it was (again) there; None: all.
        """
        self._condition = condition
        self._flight = learned.flight
        if board != self._board:
            self._board = board
            self._read_journal()
        report = VehicleReport.of(condition)
        if report != self._report:
            self._report = report
            self._tell(report, now)
        if self._target is None:
            return
        proposals = self._proposals
        proposals.update(
            now,
            system_id=self._target[0],
            learned=learned,
            parameters=parameters,
            condition=condition,
            board=board,
        )
        if self._transaction is not None or self._closing or proposals.forbidden:
            return
        if self._to_audit and not self._recoveries:
            self._audit(parameters, parameters.keys() if confirmed is None else confirmed)
        if self._recoveries:
            self._take_up(now)
        elif self._condemned:
            imu, planned = next(iter(self._condemned.items()))
            if not self._against_now() and now >= proposals.standing(imu).not_before:
                self._begin(planned.plan.reversed(), Purpose.ROLL_BACK, now)
        else:
            plan = proposals.ready()
            if plan is not None:
                self._begin(plan, Purpose.PUSH, now, in_flight=bool(condition.armed))

    def judge(self, verdicts: Sequence[Watched]) -> None:
        """What the flight after a push says; one that made it worse is taken back."""
        for verdict in verdicts:
            self.append(verdict)
            self.counters[f"verdict_{verdict.verdict.value}"] += 1
            self._notices.post(
                f"push_{verdict.verdict.value}",
                f"the flight after the push: {verdict.sentence}",
                warning=verdict.verdict is Verdict.WORSE,
            )
        if verdicts:
            self._read_journal()

    def close(self) -> None:
        """No new transaction from here on; one that has not finished stays open on disk."""
        self._closing = True

    # What people call

    def roll_back(self, imus: tuple[int, ...], now: float) -> str:
        """Write back what was in force before the last push of one accelerometer.

        Raises:
            RefusedError: there is no push in force, or now is not the moment.
        """
        in_force = {i: p for i in range(1, 6) if (p := self._last_completed(i))}
        chosen = [imu for imu in imus or in_force if imu in in_force]
        if not chosen:
            raise RefusedError("no push is in force that could be rolled back")
        if len(chosen) > 1:
            raise RefusedError(f"pushes of {named(chosen)} are in force: one at a time")
        if self._target is None or self._proposals.forbidden:
            raise RefusedError(self._proposals.forbidden or "no autopilot is heard")
        if self._transaction is not None or self._recoveries:
            raise RefusedError("another transaction is under way")
        against = self._against_now()
        if against:
            raise RefusedError(against)
        imu = chosen[0]
        self._proposals.refuse(imu, "a person rolled the last push back")
        self._begin(in_force[imu].plan.reversed(), Purpose.ROLL_BACK, now)
        return f"rolling back IMU {imu}"

    def view(self) -> PushView:
        """For the snapshot."""
        proposals = self._proposals
        state = "interrupted" if self._recoveries else "idle"
        return PushView(
            policy=proposals.settings.mode.value,
            approval_required=proposals.approval,
            approval_needed=any(
                bool(p.held_back) and p.held_back.keys() <= WAITING
                for p in proposals.current.values()
            ),
            state=state if self._transaction is None else self._transaction.state.value,
            active_imu=None if self._transaction is None else self._transaction.plan.imu,
            proposals=proposals.view(),
            last_outcome=None if self.last_outcome is None else _told(self.last_outcome),
            can_roll_back=tuple(i for i in range(1, 6) if self._last_completed(i)),
            judged=tuple(self._witness.judged.values()),
            written=written_view(
                self._journal.entries, self._target[0] if self._target else None, self._board
            ),
        )

    # How

    def _against_now(self) -> str:
        """Objections to the way back at this moment; the policy 'never' is none."""
        settings = replace(self._proposals.settings, mode=Mode.LANDED)
        return "; ".join(refusal.sentence for refusal in moment(self._condition, settings))

    def _read_journal(self) -> None:
        """What earlier transactions still ask for: to be resumed, a verdict, or the way back."""
        if self._transaction is None:
            self._recoveries = list(self._journal.recover())
        verdicts = {e.transaction: e for _, e in self._journal.entries if isinstance(e, Watched)}
        self._condemned.clear()
        for imu in range(1, 6):
            planned = self._last_completed(imu)
            if planned is None:
                self._witness.drop(imu)
                continue
            verdict = verdicts.get(planned.transaction)
            if verdict is None:
                self._witness.watch(planned, in_flight_since=self._in_flight_since)
                continue
            self._witness.drop(imu)
            if verdict.verdict is Verdict.WORSE:
                self._condemned[imu] = planned
                self._proposals.refuse(imu, f"after the last push {verdict.sentence}")

    def _last_completed(self, imu: int) -> Planned | None:
        """The push that is in force on the board that is there, as far as it tells which it is."""
        planned = self._journal.last_completed(imu)
        if planned is None or self._target is None:
            return planned
        here = planned.plan.vehicle.same_airframe(self._target[0], self._board)
        return planned if here else None

    def _audit(self, values: Mapping[str, float], confirmed: Collection[str]) -> None:
        """Whether what was pushed is still there, now that the autopilot has (perhaps) rebooted."""
        self._to_audit = False
        for imu in range(1, 6):
            planned = self._last_completed(imu)
            if planned is None or not planned.plan.wanted.keys() <= set(confirmed):
                continue
            self.counters["audits"] += 1
            recovery = audit(planned, values)
            if recovery is not None:
                text = f"IMU {imu}: values that were written are gone: the push is taken back"
                self._notices.post("push_not_stored", text, warning=True)
                self._recoveries.append(recovery)
            elif all(values[name] == value for name, value in planned.plan.wanted.items()):
                text = f"IMU {imu}: the autopilot has the values of the last push"
                self._notices.post("push_stored", text)

    def _take_up(self, now: float) -> None:
        """The first open transaction whose pause is over and whose vehicle may be there."""
        if self._against_now():
            return
        for recovery in self._recoveries:
            if now >= self._not_before.get(recovery.transaction, now):
                self._recoveries.remove(recovery)
                self._resume(recovery, now)
                return

    def _begin(
        self, plan: PushPlan, purpose: Purpose, now: float, *, in_flight: bool = False
    ) -> None:
        if self._target is None:
            return
        self.counters["pushes" if purpose is Purpose.PUSH else "roll_backs"] += 1
        what = "push" if purpose is Purpose.PUSH else "roll-back"
        self._notices.post(f"{purpose.value}_begins", f"IMU {plan.imu}: {what} begins")
        self._in_flight_since = now if in_flight else None
        self._run(
            PushTransaction(
                plan,
                identifier=uuid.uuid4().hex,
                system_id=self._target[0],
                board=self._board,
                allow_armed=in_flight,
                purpose=purpose,
                settings=PATIENCE,
                support=self._support(plan.imu) if purpose is Purpose.PUSH else None,
            ),
            now,
        )

    def _resume(self, recovery: Recovery, now: float) -> None:
        if self._target is None:
            return
        self.counters["resumed"] += 1
        text = f"IMU {recovery.plan.imu}: an interrupted push is taken up"
        self._notices.post("push_resumed", text, warning=True)
        self._in_flight_since = None
        self._run(
            PushTransaction.resume(
                recovery, system_id=self._target[0], board=self._board, settings=PATIENCE
            ),
            now,
        )

    def _support(self, imu: int) -> Support | None:
        """What the push that begins rests on."""
        if self._flight is None:
            return None
        approved = self._proposals.standing(imu).approved is not None
        return msgspec.structs.replace(self._flight.support, approved=approved)

    def _run(self, transaction: PushTransaction, now: float) -> None:
        self._transaction = transaction
        self._proposals.writing = transaction.plan.imu
        self.idle.clear()
        self._act(transaction.start(now), now)

    def _tell(self, event: TransactionEvent, now: float) -> None:
        if self._transaction is not None:
            self._act(self._transaction.feed(event, now), now)

    def _act(self, outputs: Sequence[TransactionOutput], now: float) -> None:
        """Carry out the outputs in their order, what a journal entry leads to included."""
        for output in outputs:
            match output:
                case Record(entry):
                    self._tell(self.append(entry), now)
                case Finished(outcome):
                    self._finished(outcome, now)
                case _ if isinstance(output, SendAction):
                    system, component = self._target or (0, 0)
                    self._outbox.append(
                        parameter_message(output, self._codec, system=system, component=component)
                    )

    def _refusal(self, imu: int, why: str) -> None:
        """Remember it: a restart must not write what was refused."""
        self.append(Refused(uuid.uuid4().hex, imu, why))

    def append(self, entry: Entry) -> JournalWritten | JournalFailed:
        """Write to the journal; a disk that does not take it is counted and logged."""
        try:
            self._journal.append(entry, self._wall_clock())
        except StateError as error:
            self.counters["journal_failed"] += 1
            logger.error("%s", error)  # noqa: TRY400 - a full disk is no bug of ours
            return JournalFailed(str(error))
        return JournalWritten()

    def _finished(self, outcome: Outcome, now: float) -> None:
        self._transaction = self._proposals.writing = None
        self.idle.set()
        self.last_outcome = outcome
        self.counters[f"outcome_{outcome.result.value}"] += 1
        self._notices.post(
            f"{outcome.purpose.value}_{outcome.result.value}",
            _told(outcome),
            warning=outcome.result is not Result.COMPLETED,
        )
        imu = outcome.plan.imu
        if outcome.result is Result.COMPLETED:
            self._proposals.succeeded(imu, [outcome.values[n] for n in outcome.plan.names])
        else:
            changed = outcome.reason is Reason.CHANGED_BY_OTHER
            self._proposals.failed(imu, now, changed_by_other=changed)
        if outcome.open:  # once more after a pause; of another vehicle when one turns up anew
            other = outcome.result is Result.OTHER_VEHICLE
            pause_ends = self._proposals.standing(imu).not_before
            self._not_before[outcome.transaction] = math.inf if other else pause_ends
        if outcome.reason is Reason.RESTARTED:
            self._to_audit = True  # one audit may have found more than one accelerometer
        condemned = self._condemned.get(imu)
        if condemned is not None and outcome.reason is Reason.CHANGED_BY_OTHER:
            sentence = "not taken back: somebody has changed the parameters since"
            self.append(Watched(condemned.transaction, Verdict.SUPERSEDED, sentence))
        self._read_journal()

    def _take_outbox(self) -> Sequence[Message]:
        messages, self._outbox = self._outbox, []
        return messages


def _told(outcome: Outcome) -> str:
    """One sentence about how a transaction ended."""
    what = "push" if outcome.purpose is Purpose.PUSH else "roll-back"
    how = outcome.result.value.replace("_", " ")
    return f"IMU {outcome.plan.imu}: {what} {how}: {outcome.sentence}"
