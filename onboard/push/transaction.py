"""One push as a sans-IO transaction: six parameters of one accelerometer, all or none.

Two rules, and everything else follows from them:

1. Nothing is written before what undoes it is durable: the first PARAM_SET leaves only after
   the driver has confirmed the journal's ``Planned`` entry.
2. After the first write there are three ways out: all six read back new, all six read back
   old (what somebody else wrote meanwhile is left alone), or the journal stays open and the
   transaction is resumed later.  Any trouble on the way to "new" turns it towards "old",
   and nothing turns it back.

The state machine is :data:`onboard.push.states.TRANSITIONS`.  A transaction has a
:class:`~onboard.push.course.Course`, which does what is to be done on entering a state, and
:class:`~onboard.push.answers.Answers`, which say what the autopilot's words amount to; what any
other event amounts to is here.  A driver does this::

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
copy of a write that was rolled back can put any mixture in force for a moment.)  On the way back
it is twice that: a late copy of a new value, and then an answer that was given before it came.

**Arming.**  A landed push sends a new value only within ``fresh_s`` after a HEARTBEAT that said
disarmed, and none after one that said armed.  Three things could then be done with a set of which
a part is written:

* *Finish it.*  The vehicle would take off with values that were in force for a second, read back
  for the first time in the air; and values would be set after it was armed.
* *Leave it.*  Axes do not mix: an axis is old or new, or, one at most, a new scale with an old
  offset, which errs by more than either.  The EKF, which has learned the remaining offsets of the
  old set for minutes, would take off with those of neither.
* *Undo it*, which is what is done.  The old values have flown, and the EKF's offsets are still
  theirs: it forgets in tens of seconds, and a push takes two.  The steps are small, known, and back
  to where it was.  But only while the vehicle stands: ArduPilot keeps motors idle for 2 s after
  arming, and ``armed_undo_s`` after the first HEARTBEAT that says armed, or as soon as it says that
  it is in the air, nothing more is written.  What is left is undone after the next landing, for the
  journal stays open.  To be in time old values are sent together: first those of one
  axis, so that never all offsets are zero, then all others.

A resumed transaction whose writes had all been confirmed needs only reading, and is finished
whether armed or not.
"""

from __future__ import annotations

import math
from typing import Self

from onboard.errors import PushError
from onboard.mavlink.parameter_messages import (
    ErrorReceived,
    TextReceived,
    ValueReceived,
)
from onboard.push.answers import Answers
from onboard.push.course import NOTHING, Course, Heard, TransactionSettings
from onboard.push.entries import (
    Purpose,
    Recovery,
    Result,
    Support,
)
from onboard.push.plan import PushPlan
from onboard.push.signals import (
    Cancelled,
    Heartbeat,
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
from onboard.push.states import State, Trigger


class PushTransaction:
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
        recovery: Recovery | None = None,
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
            recovery: what is taken up again (:meth:`resume`).
        """
        self._settings = settings or TransactionSettings()
        self._right_link = plan.vehicle.same_airframe(system_id, board)
        self._allow_armed = allow_armed
        self._recovery = recovery
        self._limit_at: float | None = None
        self._course = Course(plan, identifier, purpose, self._settings, support)
        self._course.progress.turned = recovery is not None and recovery.undo
        if allow_armed:
            self._course.disarmed_at = math.inf
        self._answers = Answers(self._course, recovery)

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
        return cls(
            recovery.plan,
            identifier=recovery.transaction,
            system_id=system_id,
            board=board,
            purpose=recovery.purpose,
            settings=settings,
            recovery=recovery,
        )

    @property
    def state(self) -> State:
        """Where it is."""
        return self._course.state

    @property
    def outcome(self) -> Outcome | None:
        """How it ended, None while it runs."""
        return self._course.outcome

    @property
    def purpose(self) -> Purpose:
        """To write, or to take back."""
        return self._course.purpose

    @property
    def plan(self) -> PushPlan:
        """What it writes."""
        return self._course.plan

    def start(self, now: float) -> tuple[TransactionOutput, ...]:
        """Begin.

        Raises:
            PushError: it was started before.
        """
        course = self._course
        if course.state is not State.NEW:
            raise PushError(f"transaction {course.identifier} was started before")
        self._limit_at = now + self._settings.limit_s
        if not self._right_link:
            course.note(Reason.OTHER_VEHICLE, "this is not the airframe that the plan is for")
            course.result = Result.OTHER_VEHICLE if self._recovery else Result.ABORTED
            heard = course.go(Trigger.STUCK, now)
        elif self._recovery is None:
            heard = course.go(Trigger.PUSH, now)
        else:
            course.note(Reason.RESTARTED, self._recovery.sentence)
            heard = course.go(Trigger.RESUME, now)
        self._answers.hear(heard, now)
        return course.flush()

    def next_deadline(self) -> float | None:
        """When :meth:`tick` is due, None if only an event can move it."""
        course = self._course
        if course.state is State.FINISHED:
            return None
        deadlines = [course.client.next_deadline(), course.settled_at]
        if course.state in {State.INSPECTING, State.UNDOING}:
            deadlines.append(course.undo_until)
        if course.forward:
            deadlines.append(self._limit_at)
        return min((d for d in deadlines if d is not None), default=None)

    def tick(self, now: float) -> tuple[TransactionOutput, ...]:
        """Let time pass."""
        course, answers = self._course, self._answers
        if course.state in {State.NEW, State.FINISHED}:
            return ()
        answers.hear(course.out_of_time(now), now)
        answers.hear(course.client.tick(now), now)
        if course.settled_at is not None and now >= course.settled_at:
            course.settled_at = None
            answers.hear(course.go(Trigger.WAITED, now), now)
        if course.forward and self._limit_at is not None and now >= self._limit_at:
            sentence = f"not done in {self._settings.limit_s:g} s"
            answers.hear(course.trouble(Reason.TOO_LONG, sentence, now), now)
        return course.flush()

    def feed(self, event: TransactionEvent, now: float) -> tuple[TransactionOutput, ...]:
        """Take one event; after the end nothing happens any more."""
        course = self._course
        if course.state in {State.NEW, State.FINISHED}:
            return ()
        match event:
            case ValueReceived() | ErrorReceived() | TextReceived():
                # Not after its time because nobody has looked at the clock since.
                self._answers.hear(course.out_of_time(now), now)
                heard = course.client.feed(event, now)
            case JournalWritten():
                heard = course.journalled(now)
            case JournalFailed(sentence):
                course.journal_broken = True
                text = f"the journal failed: {sentence}"
                self._answers.hear(course.trouble(Reason.JOURNAL_FAILED, text, now), now)
                heard = course.journalled(now)
            case VehicleReport():
                heard = self._vehicle(event, now)
            case Heartbeat(armed, late):
                heard = self._heartbeat(now - late, now, armed=armed)
            case Rebooted():
                heard = course.trouble(Reason.REBOOTED, "the autopilot rebooted in the middle", now)
            case LinkLost():
                heard = course.stuck(Reason.LINK_LOST, "the link was lost", now)
            case Cancelled(sentence):
                finishing = course.progress.finishing
                heard = NOTHING if finishing else course.trouble(Reason.CANCELLED, sentence, now)
        self._answers.hear(heard, now)
        return course.flush()

    def _heartbeat(self, said: float, now: float, *, armed: bool) -> Heard:
        """A landed push sends new values only to a vehicle that has just said it is disarmed."""
        course = self._course
        if self._allow_armed:
            return NOTHING
        if not armed:
            course.disarmed(said, now)
            return NOTHING
        course.armed(said)
        if course.progress.finishing:
            return NOTHING  # it only reads
        return course.trouble(Reason.ARMED, "the vehicle was armed in the middle", now)

    def _vehicle(self, report: VehicleReport, now: float) -> Heard:
        """Armed in the middle, or in flight with an EKF that became unhealthy."""
        course = self._course
        if course.progress.finishing or not report.armed:
            return NOTHING
        if not self._allow_armed:
            flying = course.out_of_time(now, flying=report.landed is False)
            return flying or self._heartbeat(now, now, armed=True)
        if report.ekf_healthy is False:
            return course.trouble(Reason.EKF_UNHEALTHY, "the EKF became unhealthy", now)
        return NOTHING
