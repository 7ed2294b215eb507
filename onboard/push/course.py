"""The course of a push: what is done on entering each state of its state machine.

The rules that it serves are in :mod:`onboard.push.transaction`, which also says which trigger an
event amounts to; the machine itself is :data:`onboard.push.states.TRANSITIONS`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

from onboard.errors import PushError
from onboard.mavlink.parameters import ClientSettings, ParameterClient, ParameterOutput
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
from onboard.push.signals import Finished, Outcome, Reason, Record, TransactionOutput
from onboard.push.states import FORWARD, TRANSITIONS, State, Trigger


@dataclass(frozen=True, slots=True, kw_only=True)
class TransactionSettings:
    """``settle_s`` must exceed the longest delay of the link; ``limit_s`` is for the way to new."""

    client: ClientSettings = field(default_factory=ClientSettings)
    settle_s: float = 2.0
    limit_s: float = 60.0
    undo_rounds: int = 3


class Course:
    """The state, the six values as last read, what is still to be written, and how it went.

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
        self._plan = plan
        self._identifier = identifier
        self._purpose = purpose
        self._support = support
        self._settings = settings
        self._client = ParameterClient(self._settings.client)
        self._turned = False
        self._state = State.NEW
        self._out: list[TransactionOutput] = []
        self._unconfirmed = 0
        self._journal_broken = False
        self._awaiting: set[str] = set()
        self._values: dict[str, float] = {}
        self._queue: list[str] = []
        self._written: set[str] = set()
        self._left: frozenset[str] = frozenset()
        self._undo_unsaved = False
        self._rounds = 0
        self._finishing = False
        self._limit_at: float | None = None
        self._settled_at: float | None = None
        self._result = Result.INTERRUPTED
        self._reason, self._sentence = Reason.NONE, ""
        self._outcome: Outcome | None = None

    def _absorb(self, outputs: tuple[ParameterOutput, ...], now: float) -> None:
        """What the parameter client says to a request of a step."""
        raise NotImplementedError

    # Steps

    def _go(self, trigger: Trigger, now: float) -> None:
        following = TRANSITIONS[self._state].get(trigger)
        if following is None:
            raise PushError(f"no transition from {self._state.value} by {trigger.value}")
        previous, self._state = self._state, following
        self._settled_at = None
        match following:
            case State.COMPARING | State.VERIFYING | State.UNDO_VERIFYING:
                self._read_six(now)
            case State.RECORDING:
                self._record(Planned(self._identifier, self._plan, self._purpose, self._support))
            case State.WRITING:
                self._queue = list(self._plan.write_order(self._values))
                self._write_next(now)
            case State.SETTLING | State.UNDO_SETTLING:
                self._finishing = previous is State.INSPECTING and following is State.SETTLING
                self._settled_at = now + self._settings.settle_s
            case State.INSPECTING:
                if previous is not State.NEW:
                    self._turn()
                self._read_six(now)
            case State.UNDOING:
                self._undo(now)
            case State.CLOSING:
                self._close(previous)
            case State.FINISHED:
                self._finish(previous)

    def _read_six(self, now: float) -> None:
        self._client.cancel()
        names = (*self._plan.names, self._plan.device_id_name)
        self._awaiting = set(names)
        self._absorb(self._client.read(names, now), now)

    def _turn(self) -> None:
        """From here on back to old, also after a crash."""
        self._finishing = False
        self._turned = True
        self._record(Undoing(self._identifier, self._reason.value, self._sentence))

    def _undo(self, now: float) -> None:
        if not self._turned:
            self._turn()
        self._rounds += 1
        if self._rounds > self._settings.undo_rounds:
            self._stuck(Reason.REVERTED, "what is undone does not stay undone", now)
            return
        self._write_next(now)

    def _write_next(self, now: float) -> None:
        undo = self._state is State.UNDOING
        target = self._plan.before if undo else self._plan.wanted
        if not self._queue:
            self._go(Trigger.DONE, now)
            return
        name = self._queue.pop(0)
        previous = self._values[name]
        self._written.add(name)
        self._record(Writing(self._identifier, name, previous, target[name], undo))
        self._absorb(self._client.set(name, target[name], now, before=previous), now)

    def _close(self, previous: State) -> None:
        if previous is State.VERIFYING:
            self._result = Result.COMPLETED
            self._sentence = self._sentence or "all six read back as wanted"
        elif previous is State.RECORDING:
            self._result = Result.ABORTED
        else:
            self._result = Result.ROLLED_BACK
            if self._left:
                self._sentence += f"; {', '.join(sorted(self._left))} left as somebody else set it"
        values = {n: self._values[n] for n in self._plan.names}
        entry = Closed(self._identifier, self._result, self._reason.value, self._sentence, values)
        self._record(entry)

    def _finish(self, previous: State) -> None:
        self._client.cancel()
        if previous is State.COMPARING:
            self._result = Result.ABORTED
        still_open = self._result in {Result.INTERRUPTED, Result.OTHER_VEHICLE}
        self._outcome = Outcome(
            transaction=self._identifier,
            plan=self._plan,
            purpose=self._purpose,
            result=self._result,
            reason=self._reason,
            sentence=self._sentence,
            values=MappingProxyType(
                {n: self._values[n] for n in self._plan.names if n in self._values}
            ),
            left=tuple(sorted(self._left)),
            open=still_open or (self._journal_broken and previous is not State.COMPARING),
        )
        self._out.append(Finished(self._outcome))

    def _record(self, entry: Entry) -> None:
        self._unconfirmed += 1
        self._out.append(Record(entry))

    def _flush(self) -> tuple[TransactionOutput, ...]:
        out, self._out = tuple(self._out), []
        return out

    # Turns

    def _trouble(self, reason: Reason, sentence: str, now: float) -> None:
        """Turn towards "old"; on that way already, or closing, it changes nothing."""
        if self._state not in FORWARD:
            return
        self._note(reason, sentence)
        self._go(Trigger.TROUBLE, now)

    def _stuck(self, reason: Reason, sentence: str, now: float) -> None:
        if self._state is State.CLOSING:
            return  # everything is read back: only the journal is waited for
        if self._state in FORWARD or self._reason in {Reason.NONE, Reason.RESTARTED}:
            self._note(reason, sentence)
        else:
            self._sentence += f"; then {sentence}"
        self._go(Trigger.STUCK, now)

    def _note(self, reason: Reason, sentence: str) -> None:
        self._reason, self._sentence = reason, sentence
