"""One push as a sans-IO transaction: six parameters of one accelerometer, all or none.

Two rules, and everything else follows from them:

1. Nothing is written before what undoes it is durable: the first PARAM_SET leaves only after
   the driver has confirmed the journal's ``Planned`` entry.
2. After the first write there are three ways out: all six read back new, all six read back
   old (what somebody else wrote meanwhile is left alone), or the journal stays open and the
   transaction is resumed later.  Any trouble on the way to "new" turns it towards "old",
   and nothing turns it back.

The state machine is :data:`onboard.push.states.TRANSITIONS`; what is done on entering a state is in
:mod:`onboard.push.course`, which trigger an event amounts to is here.  A driver does this::

    transaction = PushTransaction(plan, identifier=..., system_id=..., allow_armed=False)
    # or: PushTransaction.resume(recovery, system_id=...)  when policy.moment() has no objection
    outputs = transaction.start(now)
    outputs = transaction.feed(event, now)   # any TransactionEvent (onboard.push.signals)
    outputs = transaction.tick(now)          # not later than transaction.next_deadline()

and acts on the outputs strictly in their order:

``SendParamRead``, ``SendParamSet``
    send it (:func:`onboard.mavlink.parameter_messages.parameter_message`).
``Record(entry)``
    ``journal.append(entry, unix_time)``, then feed ``JournalWritten()``, or
    ``JournalFailed(sentence)`` on :class:`~onboard.errors.StateError`, before going on with
    the next output.
``Finished(outcome)``
    the last output.  If ``outcome.open``, ask ``journal.recover()`` again: after a pause, or
    once the link is back; after ``OTHER_VEHICLE`` not before the link has been to another
    vehicle.

Feed it every PARAM_VALUE, PARAM_ERROR and STATUSTEXT of the autopilot (others' too: that is how
a concurrent change is seen), each change of armed state and EKF health, reboots and the
loss of the link.  One transaction at a time: IMUs are pushed one after the other.

**Late packets.**  A link may duplicate and delay a PARAM_SET, and the protocol has nothing
to tell an old one from a new one.  So, after the last write, the transaction lets
``settle_s`` pass before it reads all six once more and believes them.  (Until then a late
copy of a write that was rolled back can put any mixture in force for a moment.)

**Arming.**  A landed push that sees the vehicle arm goes back at once: the old values have
flown, a half-verified set has not.  A resumed transaction whose writes had all been
confirmed needs only reading, and is finished whether armed or not.
"""

from __future__ import annotations

from typing import Self

from onboard.errors import PushError
from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    TextReceived,
    ValueReceived,
)
from onboard.mavlink.parameters import (
    Failure,
    ParameterOutput,
    ReadFailed,
    SetDone,
    SetFailed,
    ValueChanged,
    ValueRead,
)
from onboard.push.course import Course, TransactionSettings
from onboard.push.entries import (
    Purpose,
    ReadBack,
    Recovery,
    Result,
    Support,
)
from onboard.push.plan import PushPlan
from onboard.push.reading import Reading
from onboard.push.signals import (
    Cancelled,
    JournalFailed,
    JournalWritten,
    LinkLost,
    Outcome,
    Reason,
    Rebooted,
    TransactionEvent,
    TransactionOutput,
    VehicleReport,
)
from onboard.push.states import FORWARD, State, Trigger


class PushTransaction(Course):
    """See the module.  ``start`` once, then ``feed`` and ``tick`` until ``Finished``."""

    def __init__(
        self,
        plan: PushPlan,
        *,
        identifier: str,
        system_id: int,
        board: str = "",
        allow_armed: bool = False,
        purpose: Purpose = Purpose.PUSH,
        settings: TransactionSettings | None = None,
        support: Support | None = None,
    ) -> None:
        """A new push.

        Args:
            plan: what to write; judged already (:func:`onboard.push.policy.judge`).
            identifier: names the transaction in the journal, unique for ever.
            system_id: system id of the autopilot on this link.
            board: its unique id where known, as in :class:`~onboard.push.plan.Vehicle`.
            allow_armed: an in-flight push; then the EKF is watched instead of arming.
            purpose: what the plan is for; a roll-back is the plan ``reversed()``.
            settings: patience.
            support: the flight that it rests on, for the journal.
        """
        super().__init__(plan, identifier, purpose, settings or TransactionSettings(), support)
        self._right_link = plan.vehicle.same_airframe(system_id, board)
        self._allow_armed = allow_armed
        self._recovery: Recovery | None = None

    @classmethod
    def resume(
        cls,
        recovery: Recovery,
        *,
        system_id: int,
        board: str = "",
        settings: TransactionSettings | None = None,
    ) -> Self:
        """Take up what a crash, a lost link or a reboot left open.

        It is finished if every write had been confirmed and all six still read new, undone
        otherwise.  It writes: start it when :func:`onboard.push.policy.moment` allows.
        """
        new = cls(
            recovery.plan,
            identifier=recovery.transaction,
            system_id=system_id,
            board=board,
            purpose=recovery.purpose,
            settings=settings,
        )
        new._recovery = recovery
        new._turned = recovery.undo
        return new

    @property
    def state(self) -> State:
        """Where it is."""
        return self._state

    @property
    def outcome(self) -> Outcome | None:
        """How it ended, None while it runs."""
        return self._outcome

    @property
    def plan(self) -> PushPlan:
        """What it writes."""
        return self._plan

    def start(self, now: float) -> tuple[TransactionOutput, ...]:
        """Begin.

        Raises:
            PushError: it was started before.
        """
        if self._state is not State.NEW:
            raise PushError(f"transaction {self._identifier} was started before")
        self._limit_at = now + self._settings.limit_s
        if not self._right_link:
            self._note(Reason.OTHER_VEHICLE, "this is not the airframe that the plan is for")
            self._result = Result.OTHER_VEHICLE if self._recovery else Result.ABORTED
            self._go(Trigger.STUCK, now)
        elif self._recovery is None:
            self._go(Trigger.PUSH, now)
        else:
            self._note(Reason.RESTARTED, "the transaction had been interrupted")
            self._go(Trigger.RESUME, now)
        return self._flush()

    def next_deadline(self) -> float | None:
        """When :meth:`tick` is due, None if only an event can move it."""
        if self._state is State.FINISHED:
            return None
        deadlines = [self._client.next_deadline(), self._settled_at]
        if self._state in FORWARD:
            deadlines.append(self._limit_at)
        return min((d for d in deadlines if d is not None), default=None)

    def tick(self, now: float) -> tuple[TransactionOutput, ...]:
        """Let time pass."""
        if self._state in {State.NEW, State.FINISHED}:
            return ()
        self._absorb(self._client.tick(now), now)
        if self._settled_at is not None and now >= self._settled_at:
            self._settled_at = None
            self._go(Trigger.WAITED, now)
        if self._state in FORWARD and self._limit_at is not None and now >= self._limit_at:
            self._trouble(Reason.TOO_LONG, f"not done in {self._settings.limit_s:g} s", now)
        return self._flush()

    def feed(self, event: TransactionEvent, now: float) -> tuple[TransactionOutput, ...]:
        """Take one event; after the end nothing happens any more."""
        if self._state in {State.NEW, State.FINISHED}:
            return ()
        match event:
            case ValueReceived() | ErrorReceived() | TextReceived():
                self._absorb(self._client.feed(event, now), now)
            case JournalWritten():
                self._journalled(now)
            case JournalFailed(sentence):
                self._journal_broken = True
                self._trouble(Reason.JOURNAL_FAILED, f"the journal failed: {sentence}", now)
                self._journalled(now)
            case VehicleReport():
                self._vehicle(event, now)
            case Rebooted():
                self._trouble(Reason.REBOOTED, "the autopilot rebooted in the middle", now)
            case LinkLost():
                self._stuck(Reason.LINK_LOST, "the link was lost", now)
            case Cancelled(sentence):
                if not self._finishing:
                    self._trouble(Reason.CANCELLED, sentence, now)
        return self._flush()

    # What events amount to

    def _vehicle(self, report: VehicleReport, now: float) -> None:
        if self._finishing or not report.armed:
            return
        if not self._allow_armed:
            self._trouble(Reason.ARMED, "the vehicle was armed in the middle", now)
        elif report.ekf_healthy is False:
            self._trouble(Reason.EKF_UNHEALTHY, "the EKF became unhealthy", now)

    def _journalled(self, now: float) -> None:
        self._unconfirmed = max(0, self._unconfirmed - 1)
        if self._unconfirmed == 0 and self._state in {State.RECORDING, State.CLOSING}:
            self._go(Trigger.DURABLE, now)

    def _absorb(self, outputs: tuple[ParameterOutput, ...], now: float) -> None:
        state = self._state
        for output in outputs:
            if self._state is not state:
                return  # the rest answers questions of a state that is left
            match output:
                case ValueRead(name, value):
                    self._value_read(name, value, now)
                case ReadFailed(name, failure):
                    self._stuck_or_trouble(name, failure, now)
                case SetDone():
                    self._set_done(output, now)
                case SetFailed(name, failure, value):
                    self._set_failed(name, failure, value, now)
                case ValueChanged(name, _, value):
                    # May be a late duplicate: only a read of our own convicts.
                    if self._state in FORWARD and value != self._expected(name, value):
                        self._absorb(self._client.read((name,), now), now)
                case _:
                    self._out.append(output)

    def _expected(self, name: str, otherwise: float) -> float:
        if name == self._plan.device_id_name:
            return self._plan.vehicle.device_id
        if name not in self._plan.names:
            return otherwise
        written = name in self._written or self._finishing
        return (self._plan.wanted if written else self._plan.before)[name]

    def _value_read(self, name: str, value: float, now: float) -> None:
        if name in self._awaiting:
            self._awaiting.discard(name)
            self._values[name] = value
            if not self._awaiting:
                self._all_read(now)
        elif self._state in FORWARD and value != self._expected(name, value):
            self._trouble(Reason.CHANGED_BY_OTHER, f"{name} became {value:.7g} meanwhile", now)

    def _stuck_or_trouble(self, name: str, failure: Failure, now: float) -> None:
        sentence = f"{name} cannot be read: {failure.value}"
        if self._state in FORWARD:
            self._trouble(Reason.SILENT, sentence, now)
        else:
            self._stuck(Reason.SILENT, sentence, now)

    def _set_done(self, done: SetDone, now: float) -> None:
        self._values[done.name] = done.value
        self._record(ReadBack(self._identifier, done.name, done.value, done.saved))
        if not done.saved:
            self._undo_unsaved |= self._state is State.UNDOING
            sentence = f"{done.name} is in force, but the autopilot does not say that it is stored"
            self._trouble(Reason.NOT_SAVED, sentence, now)
        if self._state in {State.WRITING, State.UNDOING}:
            self._write_next(now)

    def _set_failed(self, name: str, failure: Failure, value: float | None, now: float) -> None:
        reason = {
            Failure.SILENT: Reason.SILENT,
            Failure.CHANGED_BY_OTHER: Reason.CHANGED_BY_OTHER,
        }.get(failure, Reason.DENIED)
        sentence = f"{name} was not written: {failure.value}"
        if self._state is State.WRITING:
            self._trouble(reason, sentence, now)
        elif self._state is State.UNDOING:
            if reason is Reason.CHANGED_BY_OTHER and value is not None:
                self._left |= {name}
                self._values[name] = value
                self._write_next(now)
            else:
                self._stuck(reason, sentence, now)

    def _all_read(self, now: float) -> None:
        """The six and the accelerometer's id were read: what do they say?"""
        plan, reading = self._plan, Reading(self._plan, self._values)
        if not reading.right_device:
            sentence = f"{plan.device_id_name} is another accelerometer's"
            if self._state in FORWARD:
                self._trouble(Reason.OTHER_VEHICLE, sentence, now)
            else:
                self._result = Result.OTHER_VEHICLE
                self._stuck(Reason.OTHER_VEHICLE, sentence, now)
        elif self._state in FORWARD:
            comparing = self._state is State.COMPARING
            wrong = reading.unlike(plan.before if comparing else plan.wanted)
            if not wrong:
                self._go(Trigger.AGREES, now)
            elif comparing or reading.foreign:
                self._trouble(Reason.CHANGED_BY_OTHER, wrong, now)
            else:
                self._trouble(Reason.REVERTED, wrong, now)
        else:
            self._left = reading.left
            if self._can_finish(reading):
                self._go(Trigger.ALL_NEW, now)
            elif reading.undo_order:
                self._queue = list(reading.undo_order)
                self._go(Trigger.DIFFERS, now)
            elif self._undo_unsaved and self._state is State.UNDO_VERIFYING:
                sentence = "the old values are in force, but not known to be stored"
                self._stuck(Reason.NOT_SAVED, sentence, now)
            else:
                self._go(Trigger.AGREES, now)

    def _can_finish(self, reading: Reading) -> bool:
        """Whether a resumed transaction needs nothing but its verification."""
        if self._turned or self._recovery is None or self._state is not State.INSPECTING:
            return False
        return self._recovery.all_confirmed and not reading.unlike(self._plan.wanted)
