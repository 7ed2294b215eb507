"""The course of a push: its state, and what is done on entering each state.

The rules that it serves are in :mod:`onboard.push.transaction`; which trigger an answer of the
autopilot amounts to is said by :mod:`onboard.push.answers`; the state machine itself is
:data:`onboard.push.states.TRANSITIONS`.

A step may ask the autopilot for something.  What the parameter client says to that at once is
*returned* by the step, for whoever took it to hear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias

from onboard.errors import PushError
from onboard.mavlink.parameter_messages import SendAction, SendParamSet
from onboard.mavlink.parameters import ClientSettings, ParameterClient, ParameterOutput
from onboard.push import limits
from onboard.push.entries import (
    Closed,
    Entry,
    Planned,
    Purpose,
    Result,
    Support,
    Undoing,
    Writing,
)
from onboard.push.plan import PushPlan
from onboard.push.progress import Progress
from onboard.push.signals import Finished, Outcome, Reason, Record, TransactionOutput
from onboard.push.states import FORWARD, TRANSITIONS, State, Trigger

Heard: TypeAlias = tuple[ParameterOutput, ...]
"""What the parameter client said to the request of a step."""
NOTHING: Heard = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class TransactionSettings:
    """``settle_s`` must exceed the longest delay of the link; ``limit_s`` is for the way to new.

    ``fresh_s``: so old the last word that it is disarmed may be when a new value is sent;
    ``armed_undo_s``: so long after the first word that it is armed old values are written back.
    """

    client: ClientSettings = field(default_factory=ClientSettings)
    settle_s: float = limits.SETTLE_S
    limit_s: float = limits.TRANSACTION_S
    undo_rounds: int = limits.UNDO_ROUNDS
    fresh_s: float = limits.FRESH_S
    armed_undo_s: float = limits.ARMED_UNDO_S


class Course:
    """Where a transaction is, what it has come to, and the steps from state to state.

    Args:
        plan: what to write.
        identifier: names the transaction in the journal.
        purpose: what the plan is for.
        settings: patience.
        support: what a push rests on.
    """

    def __init__(
        self,
        plan: PushPlan,
        identifier: str,
        purpose: Purpose,
        settings: TransactionSettings,
        support: Support | None = None,
    ) -> None:
        self.plan = plan
        self.identifier = identifier
        self.purpose = purpose
        self.client = ParameterClient(settings.client)
        self.state = State.NEW
        self.progress = Progress()
        self.settled_at: float | None = None
        self.disarmed_at = -math.inf
        """When the vehicle last said that it is disarmed, if it has not said otherwise since."""
        self.undo_until: float | None = None
        """Until then an old value may be sent, for the vehicle is armed; None: it is not."""
        self._held: dict[str, SendParamSet] = {}
        self.journal_broken = False
        self.result = Result.INTERRUPTED
        self.reason, self.sentence = Reason.NONE, ""
        self.outcome: Outcome | None = None
        self._support = support
        self._settings = settings
        self._out: list[TransactionOutput] = []
        self._unconfirmed = 0

    @property
    def forward(self) -> bool:
        """Whether it is on the way to "new"."""
        return self.state in FORWARD

    # Steps

    def go(self, trigger: Trigger, now: float) -> Heard:
        """Take the step that a trigger leads to.

        Raises:
            PushError: the state machine has no such step.
        """
        following = TRANSITIONS[self.state].get(trigger)
        if following is None:
            raise PushError(f"no transition from {self.state.value} by {trigger.value}")
        previous, self.state = self.state, following
        self.settled_at = None
        if not self.forward:
            self._held.clear()
        match following:
            case State.COMPARING | State.VERIFYING | State.UNDO_VERIFYING:
                return self.read_six(now)
            case State.RECORDING:
                self.record(Planned(self.identifier, self.plan, self.purpose, self._support))
            case State.WRITING:
                self.progress.queue = list(self.plan.write_order(self.progress.values))
                return self.write_next(now)
            case State.SETTLING | State.UNDO_SETTLING:
                resumed = previous is State.INSPECTING and following is State.SETTLING
                self.progress.finishing = resumed
                # On the way back a new value may still come, and after it an answer from before.
                delays = 1 if following is State.SETTLING else 2
                self.settled_at = now + delays * self._settings.settle_s
            case State.INSPECTING:
                if previous is not State.NEW:
                    self._turn()
                return self.read_six(now)
            case State.UNDOING:
                return self._undo(now)
            case State.CLOSING:
                self._close(previous)
            case State.FINISHED:
                self._finish(previous)
        return NOTHING

    def write_next(self, now: float) -> Heard:
        """Write what is next in the queue, or go on when all is written."""
        undo = self.state is State.UNDOING
        queue = self.progress.queue
        if undo and self.client.busy:
            return NOTHING
        if not queue:
            return self.go(Trigger.DONE, now)
        if not undo or self.undo_until is None:
            return self._write(queue.pop(0), now, undo=undo)
        # An armed vehicle gets its old values back all at once: there is no time for one by one.
        # But for the axis that keeps the offsets from being zero in between: that comes before.
        first = sum(name[-1] == queue[0][-1] for name in queue)
        count = len(queue) if self.progress.axis_undone else first
        self.progress.axis_undone = True
        heard = NOTHING
        for _ in range(count):
            heard += self._write(queue.pop(0), now, undo=True)
        return heard

    def _write(self, name: str, now: float, *, undo: bool) -> Heard:
        value = (self.plan.before if undo else self.plan.wanted)[name]
        previous = self.progress.values[name]
        self.progress.written.add(name)
        self.record(Writing(self.identifier, name, previous, value, undo))
        return self.client.set(name, value, now, before=previous)

    def answered(self, name: str) -> None:
        """A write is read back: what was held of it, to repeat it, is not sent any more."""
        self._held.pop(name, None)

    # Armed or not

    def disarmed(self, said: float, now: float) -> None:
        """The vehicle has said so: what was held back may go, if that was just now."""
        self.undo_until = None
        self.disarmed_at = said
        if now <= self._until:
            self._out.extend(self._held.values())
            self._held.clear()

    def armed(self, said: float) -> None:
        """It has said that: no new value from here on, and not much time for old ones.

        Where nothing was heard before that for longer than a new value may wait, this need not be
        its first word that it is armed.
        """
        if self.undo_until is None:
            if self.disarmed_at > -math.inf:
                said = min(said, self.disarmed_at + self._settings.fresh_s)
            self.undo_until = said + self._settings.armed_undo_s
        self.disarmed_at = -math.inf

    @property
    def _until(self) -> float:
        """Until then a value may be sent.

        A new one while it is disarmed, an old one while it stands, also if it has armed at once
        after its last word.
        """
        if self.forward:
            return self.disarmed_at + self._settings.fresh_s
        if self.undo_until is None:
            return self.disarmed_at + self._settings.armed_undo_s
        return self.undo_until

    def out_of_time(self, now: float, *, flying: bool = False) -> Heard:
        """Leave what is not undone yet to the next time on the ground, once it is too late."""
        if self.state not in {State.INSPECTING, State.UNDOING} or self.undo_until is None:
            return NOTHING
        if not flying and now < self.undo_until:
            return NOTHING
        return self.stuck(Reason.ARMED, "armed: the rest is undone on the ground", now)

    def trouble(self, reason: Reason, sentence: str, now: float) -> Heard:
        """Turn towards "old"; on that way already, or closing, it changes nothing."""
        if not self.forward:
            return NOTHING
        self.note(reason, sentence)
        return self.go(Trigger.TROUBLE, now)

    def stuck(self, reason: Reason, sentence: str, now: float) -> Heard:
        """Nothing more can be done now: the journal stays open."""
        if self.state is State.CLOSING:
            return NOTHING  # everything is read back: only the journal is waited for
        if self.forward or self.reason in {Reason.NONE, Reason.RESTARTED}:
            self.note(reason, sentence)
        else:
            self.sentence += f"; then {sentence}"
        return self.go(Trigger.STUCK, now)

    def note(self, reason: Reason, sentence: str) -> None:
        """Remember why it does not simply complete."""
        self.reason, self.sentence = reason, sentence

    # The journal, and what goes out

    def record(self, entry: Entry) -> None:
        """Have an entry written before anything that follows it."""
        self._unconfirmed += 1
        self._out.append(Record(entry))

    def journalled(self, now: float) -> Heard:
        """The oldest entry is on the disk, or cannot be written."""
        self._unconfirmed = max(0, self._unconfirmed - 1)
        if self._unconfirmed == 0 and self.state in {State.RECORDING, State.CLOSING}:
            return self.go(Trigger.DURABLE, now)
        return NOTHING

    def send(self, output: SendAction, now: float) -> None:
        """Hand out a message that the parameter client wants sent.

        A value waits for a vehicle that has just said that it is disarmed.
        """
        if isinstance(output, SendParamSet) and now > self._until:
            self._held[output.name] = output
        else:
            self._out.append(output)

    def flush(self) -> tuple[TransactionOutput, ...]:
        """All that is to be acted on, in order."""
        out, self._out = tuple(self._out), []
        return out

    # On entering a state

    def read_six(self, now: float) -> Heard:
        """Ask for the six and the accelerometer's identifier."""
        self.client.cancel()
        names = (*self.plan.names, self.plan.device_id_name)
        self.progress.awaiting = set(names)
        return self.client.read(names, now)

    def _turn(self) -> None:
        """From here on back to old, also after a crash."""
        self.progress.finishing = False
        self.progress.turned = True
        self.record(Undoing(self.identifier, self.reason.value, self.sentence))

    def _undo(self, now: float) -> Heard:
        if self.plan.no_way_back:  # of a journal that somebody has changed, or an older version's
            sentence = f"not written back: {self.plan.no_way_back}"
            return self.stuck(Reason.NO_WAY_BACK, sentence, now)
        if not self.progress.turned:
            self._turn()
        self.progress.rounds += 1
        self.progress.axis_undone = False
        if self.progress.rounds > self._settings.undo_rounds:
            return self.stuck(
                Reason.REVERTED, "the old values were written back, but do not stay", now
            )
        if self.undo_until is not None and now >= self.undo_until:
            return self.out_of_time(now)
        return self.write_next(now)

    def _close(self, previous: State) -> None:
        left = self.progress.left
        if previous is State.VERIFYING:
            self.result = Result.COMPLETED
            self.sentence = self.sentence or "all six read back as wanted"
        elif previous is State.RECORDING:
            self.result = Result.ABORTED
        else:
            self.result = Result.ROLLED_BACK
            if left:
                self.sentence += f"; {', '.join(sorted(left))} left as somebody else set it"
        values = {n: self.progress.values[n] for n in self.plan.names}
        self.record(Closed(self.identifier, self.result, self.reason.value, self.sentence, values))

    def _finish(self, previous: State) -> None:
        self.client.cancel()
        if previous is State.COMPARING:
            self.result = Result.ABORTED
        still_open = self.result in {Result.INTERRUPTED, Result.OTHER_VEHICLE}
        values = self.progress.values
        self.outcome = Outcome(
            transaction=self.identifier,
            plan=self.plan,
            purpose=self.purpose,
            result=self.result,
            reason=self.reason,
            sentence=self.sentence,
            values=MappingProxyType({n: values[n] for n in self.plan.names if n in values}),
            left=tuple(sorted(self.progress.left)),
            open=still_open or (self.journal_broken and previous is not State.COMPARING),
        )
        self._out.append(Finished(self.outcome))
