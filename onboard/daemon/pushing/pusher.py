"""The pusher: decides which transaction begins, and what its end means for the next one.

Participant of the link.  A :class:`~onboard.daemon.pushing.writer.Writer` carries a transaction
out, a :class:`~onboard.daemon.pushing.ledger.Ledger` says what earlier ones still ask for.
"""

from __future__ import annotations

import uuid
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence

import msgspec

from onboard.daemon.learning.flight import JudgedFlight
from onboard.daemon.learning.learned import Learned
from onboard.daemon.pushing.aftercare import ASKED
from onboard.daemon.pushing.duties import Duties
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.pushing.people import named
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.push_view import push_view, told
from onboard.daemon.pushing.witness import Witness
from onboard.daemon.pushing.writer import Writer
from onboard.daemon.view.notices import Notices
from onboard.daemon.view.snapshot import PushView
from onboard.errors import RefusedError
from onboard.mavlink.autopilot import (
    AutopilotFound,
    AutopilotRebooted,
    AutopilotSilent,
    LinkEvent,
    RivalHeard,
    TwinHeard,
)
from onboard.mavlink.decode import is_armed, is_autopilot
from onboard.mavlink.dialect import Message
from onboard.push.course import TransactionSettings
from onboard.push.entries import INTERRUPTED, Planned, Purpose, Recovery, Result, Support, Watched
from onboard.push.plan import PushPlan
from onboard.push.policy import VehicleCondition
from onboard.push.signals import (
    Cancelled,
    Heartbeat,
    LinkLost,
    Outcome,
    Reason,
    Rebooted,
    VehicleReport,
)
from onboard.push.transaction import PushTransaction

PATIENCE = TransactionSettings()


class Pusher:
    """One per daemon; ``now`` is a monotonic clock.

    Raises:
        StateError: an open transaction in the journal has lost its plan.
    """

    names = (*Writer.names, "HEARTBEAT")

    def __init__(
        self, ledger: Ledger, proposals: Proposals, witness: Witness, notices: Notices
    ) -> None:
        self.last_outcome: Outcome | None = None
        self.late: Callable[[], float] = lambda: 0.0
        """By how much what the autopilot says is behind, s."""
        self._counts: Counter[str] = Counter()
        self._ledger = ledger
        self._proposals = proposals
        self._witness = witness
        self._notices = notices
        self._writer = Writer(ledger)
        self._flight: JudgedFlight | None = None
        self._in_flight_since: float | None = None
        self._report = VehicleReport()
        self._condition = VehicleCondition()
        self._parameters: Mapping[str, float] = {}
        self._duties = Duties(ledger, proposals, witness, notices)
        self._closing = self._silent = False
        self._mended = ledger.mended
        self.idle = self._writer.idle
        self._read_ledger()

    @property
    def busy(self) -> bool:
        """Whether a transaction is under way."""
        return self._writer.busy

    @property
    def writes_on_the_ground(self) -> bool:
        """Whether a transaction is under way with a vehicle that stands."""
        return self.busy and self._in_flight_since is None

    @property
    def has_written(self) -> bool:
        """Whether a transaction was begun in this run."""
        return any(self._counts[name] for name in ("pushes", "roll_backs", "resumed"))

    @property
    def counters(self) -> Counter[str]:
        """What happened, by name."""
        return self._counts + self._ledger.counters

    # What the link calls

    def start(self, system: int, component: int, now: float) -> None:  # noqa: ARG002 - the participants' signature
        """An autopilot is there (again): open transactions may be taken up, pushes have to show."""
        if self._writer.target != (system, component):
            self._parameters = {}
            self._duties.aftercare.another()
        self._writer.target = (system, component)
        self._condition, self._silent = VehicleCondition(), False
        self._ledger.system_id = system
        self._duties.begin()
        self._read_ledger()

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take the autopilot's word on a parameter, or on whether it is armed: at once."""
        if is_autopilot(message):
            source = (message.get_srcSystem(), message.get_srcComponent())
            if source == self._writer.target:
                self._heard_armed(is_armed(message), now, self.late())
        self._ended(self._writer.hear(message, now), now)
        return self._writer.take_outbox()

    def poll(self, now: float) -> Sequence[Message]:
        """Let time pass for the transaction; messages that are due."""
        self._ended(self._writer.tick(now), now)
        return self._writer.take_outbox()

    def on_event(self, now: float, event: LinkEvent) -> None:
        """What happens to the autopilot in the middle of a transaction."""
        match event:
            case AutopilotRebooted():
                self._duties.aftercare.rebooted(self._parameters, busy=self.busy)
                self._ended(self._writer.tell(Rebooted(), now), now)
            case AutopilotSilent() | AutopilotFound():
                self._silent = isinstance(event, AutopilotSilent)
                self._duties.aftercare.silent()
                self._ended(self._writer.tell(LinkLost(), now), now)
            case RivalHeard(armed=True):
                self._heard_armed(True, now, 0.0)  # noqa: FBT003 - of whomever: it may be the real one
            case TwinHeard(earlier=True):
                text = "another service that was there first writes to this vehicle"
                self._ended(self._writer.tell(Cancelled(text), now), now)
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
        self._parameters = parameters
        if board != self._ledger.board:
            self._ledger.board = board
            self._duties.aftercare.another()
            self._read_ledger()
        report = VehicleReport.of(condition)
        if report != self._report:
            self._report = report
            self._ended(self._writer.tell(report, now), now)
        if self._writer.target is None:
            return
        self._proposals.update(
            now,
            system_id=self._writer.target[0],
            learned=learned,
            parameters=parameters,
            condition=condition,
            board=board,
        )
        if self.busy or self._closing or self._proposals.forbidden:
            return
        if self._ledger.mended != self._mended:
            self._mended = self._ledger.mended
            self._proposals.recall()  # by a journal that could not be read before
            self._duties.mended()
            self._read_ledger()
            return  # proposals are made anew first
        if self._duties.look(parameters, parameters.keys() if confirmed is None else confirmed):
            self._read_ledger()
        self._start_what_is_due(now)

    def judge(self, verdicts: Sequence[Watched]) -> None:
        """What the flight after a push says; one that made it worse is taken back."""
        if self._duties.judge(verdicts):
            self._read_ledger()

    def close(self) -> None:
        """No new transaction from here on; one that has not finished stays open on disk."""
        self._closing = True

    # What people call

    def roll_back(self, imus: tuple[int, ...], now: float) -> str:
        """Write back what was in force before the last push of one accelerometer.

        Raises:
            RefusedError: there is no push in force, or now is not the moment.
        """
        asked = self._duties.aftercare.asked
        plans = {imu: written.plan for imu, written in (self._in_force() | asked).items()}
        chosen = [imu for imu in imus or plans if imu in plans]
        if not chosen:
            raise RefusedError("no push is in force that could be rolled back")
        if len(chosen) > 1:
            raise RefusedError(f"pushes of {named(chosen)} are in force: one at a time")
        if self._writer.target is None or self._proposals.forbidden:
            raise RefusedError(self._proposals.forbidden or "no autopilot is heard")
        if self._ledger.trouble:
            raise RefusedError(self._ledger.trouble)
        if self._silent:
            raise RefusedError("the autopilot is silent: nothing can be rolled back now")
        if self.busy or self._duties.unfinished:
            raise RefusedError("another transaction is under way")
        against = self._duties.against(self._condition)
        if against:
            raise RefusedError(against)
        imu, plan = chosen[0], plans[chosen[0]]
        if plan.no_way_back:
            raise RefusedError(f"before the push was {plan.no_way_back}: not written back")
        if imu in asked:
            self._resume(asked[imu], now)
        else:
            self._begin(plan.reversed(), Purpose.ROLL_BACK, now)
        return f"rolling back IMU {imu}"

    def view(
        self, there: Mapping[str, float], heard: Mapping[str, float], condition: VehicleCondition
    ) -> PushView:
        """For the snapshot; what has not ended as :meth:`Duties.not_ended` says."""
        proposals, ledger = self._proposals, self._ledger
        return push_view(
            proposals,
            ledger,
            transaction=self._writer.transaction,
            last=self.last_outcome,
            judged=tuple(self._witness.judged.values()),
            in_force=self._in_force(),
            lost=self._duties.aftercare.lost.keys(),
            mixed=self._duties.aftercare.mixed.keys(),
            asked=self._duties.aftercare.asked.keys(),
            unfinished=self._duties.not_ended(there, heard, condition),
        )

    def _in_force(self) -> dict[int, Planned]:
        return self._ledger.all_in_force(self._parameters, self._proposals.writing)

    def stop(self, sentence: str, now: float) -> None:
        """Have a transaction under way undone."""
        self._ended(self._writer.tell(Cancelled(sentence), now), now)

    def abandon(self, imus: tuple[int, ...], sentence: str, now: float) -> bool:
        """A person wants none of what is being written to these (none named: whatever it is).

        Returns:
            Whether that is undone now; a way back goes on.
        """
        under_way = self._writer.transaction
        if under_way is None or under_way.purpose is not Purpose.PUSH:
            return False
        if imus and under_way.plan.imu not in imus:
            return False
        self.stop(sentence, now)
        return True

    def _heard_armed(self, armed: bool, now: float, late: float) -> None:  # noqa: FBT001 - what was heard
        self._ended(self._writer.tell(Heartbeat(armed, late), now), now)

    def _read_ledger(self) -> None:
        self._duties.read(busy=self.busy, in_flight_since=self._in_flight_since)

    def _start_what_is_due(self, now: float) -> None:
        """Unfinished business first, then the way back, then what is proposed."""
        duties = self._duties
        if duties.unfinished or duties.condemned:
            if self._duties.against(self._condition):
                return
            if duties.unfinished:
                recovery = duties.take_up(now)
                if recovery is not None:
                    self._resume(recovery, now)
            else:
                worse = duties.take_back(now)
                if worse is not None:
                    self._begin(worse.plan.reversed(), Purpose.ROLL_BACK, now)
            return
        plan = self._proposals.ready()
        if plan is not None:
            self._begin(plan, Purpose.PUSH, now, in_flight=bool(self._condition.armed))

    def _begin(
        self, plan: PushPlan, purpose: Purpose, now: float, *, in_flight: bool = False
    ) -> None:
        if self._writer.target is None:
            return
        self._counts["pushes" if purpose is Purpose.PUSH else "roll_backs"] += 1
        what = "push" if purpose is Purpose.PUSH else "roll-back"
        self._notices.post(f"{purpose.value}_begins", f"IMU {plan.imu}: {what} begins")
        self._in_flight_since = now if in_flight else None
        support: Support | None = None  # what the push rests on
        if purpose is Purpose.PUSH and self._flight is not None:
            approved = self._proposals.standing(plan.imu).approved is not None
            support = msgspec.structs.replace(self._flight.support, approved=approved)
        self._run(
            PushTransaction(
                plan,
                identifier=uuid.uuid4().hex,
                system_id=self._writer.target[0],
                board=self._ledger.board,
                allow_armed=in_flight,
                purpose=purpose,
                settings=PATIENCE,
                support=support,
            ),
            now,
        )

    def _resume(self, recovery: Recovery, now: float) -> None:
        if self._writer.target is None:
            return
        self._counts["resumed"] += 1
        if recovery.sentence == INTERRUPTED:  # of all others it was said before
            what = "push" if recovery.purpose is Purpose.PUSH else "roll-back"
            text = f"IMU {recovery.plan.imu}: an interrupted {what} is taken up"
            self._notices.post("push_resumed", text, warning=True)
        elif recovery.sentence == ASKED:
            text = f"IMU {recovery.plan.imu}: roll-back begins"
            self._notices.post("roll_back_begins", text)
        self._in_flight_since = None
        self._run(
            PushTransaction.resume(
                recovery,
                system_id=self._writer.target[0],
                board=self._ledger.board,
                settings=PATIENCE,
            ),
            now,
        )

    def _run(self, transaction: PushTransaction, now: float) -> None:
        self._proposals.writing = transaction.plan.imu
        self._ended(self._writer.begin(transaction, now), now)

    def _ended(self, outcome: Outcome | None, now: float) -> None:
        """What follows from the end of a transaction, if it has ended."""
        if outcome is None:
            return
        self._proposals.writing = None
        self.last_outcome = outcome
        self._counts[f"outcome_{outcome.result.value}"] += 1
        asked = outcome.result is Result.ROLLED_BACK and outcome.sentence.startswith(ASKED)
        kind = f"{outcome.purpose.value}_{outcome.result.value}"
        well = asked or outcome.result is Result.COMPLETED
        self._notices.post(
            "roll_back_completed" if asked else kind, told(outcome), warning=not well
        )
        imu = outcome.plan.imu
        if well:
            self._proposals.succeeded(imu, [outcome.values[n] for n in outcome.plan.names])
            back = asked or outcome.purpose is Purpose.ROLL_BACK
            if back and imu not in self._ledger.condemned:  # of those it was said why
                self._proposals.refuse(imu, "a person rolled the last push back")
        else:
            changed = outcome.reason is Reason.CHANGED_BY_OTHER
            self._proposals.failed(imu, now, changed_by_other=changed)
        self._duties.ended(outcome, now)
        self._read_ledger()
