"""One history: a push, everything that goes wrong with it, and whether the rules held.

Real are the transaction, the policy, the journal and what observes the vehicle; link, autopilot,
disk and clock are simulated.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.pushes.disk import Disk, KilledError, journals_on
from benchmarks.pushes.faults import TURBULENCE_S, Script
from benchmarks.pushes.mishaps import Mishaps
from benchmarks.pushes.rules import Rules
from benchmarks.pushes.story import Story
from benchmarks.pushes.vehicle import Agenda, Autopilot, Link, float32
from onboard.core.inputs.samples import VehicleState
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.process.condition import Observed
from onboard.errors import StateError
from onboard.mavlink.parameter_messages import SendAction
from onboard.push.entries import Planned, Result, audit
from onboard.push.journal import Journal
from onboard.push.plan import Baseline, Change, PushPlan, Vehicle
from onboard.push.policy import Mode, PolicySettings, moment
from onboard.push.signals import (
    Finished,
    Heartbeat,
    JournalFailed,
    JournalWritten,
    LinkLost,
    Rebooted,
    Record,
    TransactionEvent,
    TransactionOutput,
    VehicleReport,
)
from onboard.push.transaction import PushTransaction

DEVICE = 3e6
SILENT_S = 5.0
PAUSE_S = 6.0
END_S = 400.0
SETTINGS = PolicySettings(disarmed_s=2.0)
UNDO = PolicySettings(disarmed_s=2.0, mode=Mode.LANDED)
SCALES = ((1.0, 1.0, 1.0), (1.013, 0.988, 1.007))


class History:
    """Plays one script; ``lines`` tell what happened."""

    def __init__(self, script: Script, folder: Path) -> None:
        self.script = script
        self.lines = script.lines
        self.rng = random.Random(script.seed * 7919 + 1)  # noqa: S311 - chance, no secret
        self.agenda = Agenda()
        self.link = Link(self.agenda, script.weather, self.rng)
        self.plan = _plan(script)
        parameters = {**self.plan.before, self.plan.device_id_name: DEVICE}
        self.autopilot = Autopilot(parameters, self.agenda, self.link, self._hear)
        self.autopilot.store_delay = script.store_delay
        self.autopilot.quantum = script.quantum
        self.autopilot.wrong_echo = script.wrong_echo
        self.disk = Disk(self.rng)
        self.story = Story(script, self.agenda)
        self.rules = Rules(script, self.plan, self.agenda, self.autopilot, self.story)
        self.autopilot.changed = self.rules.offsets
        self.mishaps = Mishaps(
            self.plan, self.agenda, self.autopilot, self.link, self.disk, self.story
        )
        self._path = folder / f"{script.seed}.jsonl"
        self._deaths = list(script.deaths)
        self._disk_deaths = list(script.disk_deaths)
        self._journal: Journal | None = None
        self._transaction: PushTransaction | None = None
        self._observed = Observed()
        self._heard: tuple[float, bool] | None = None
        self._heard_at = 0.0
        self._armed_since: float | None = None
        self._not_before = 0.0
        self._pushed = False
        self._in_flight = False
        self._seen_boots = 0
        self._steps = 0
        self._step_limit: float = math.inf
        self._flying_told = False

    # The course of it

    def play(self) -> None:
        """From beginning to end.

        Raises:
            BrokenRuleError: a rule did not hold.
        """
        for fault in self.script.faults:
            self.agenda.at(fault.at, partial(self.mishaps.happen, fault))
        self.agenda.at(TURBULENCE_S, self._calm)
        with journals_on(self.disk):
            try:
                self._guarded(self._start)
                self._tick()
                while not self._is_over():
                    self._advance()
                self._audit()
                self.rules.end(self._journal)
            finally:
                self._close()
                self._path.unlink(missing_ok=True)
                self._path.with_suffix(".jsonl.new").unlink(missing_ok=True)

    def _advance(self) -> None:
        deadline = None if self._transaction is None else self._transaction.next_deadline()
        following = self.agenda.next()
        if deadline is not None and deadline < following:
            self.agenda.now = max(self.agenda.now, deadline)
            transaction = self._transaction
            if transaction is not None:
                self._guarded(lambda: self._act(transaction.tick(self.agenda.now)))
        else:
            self.agenda.step()
        if self.agenda.now > END_S:
            self.story.broken("it never comes to an end")

    def _is_over(self) -> bool:
        calm = self.agenda.now > TURBULENCE_S + 4.0
        if not calm or self._journal is None or self._transaction is not None:
            return False
        return not self._journal.recover()

    def _tick(self) -> None:
        """What the service does now and then."""
        self._guarded(self._consider)
        self.agenda.at(self.agenda.now + 0.25, self._tick)

    def _consider(self) -> None:
        now = self.agenda.now
        if self._journal is None:
            self._start()
            return
        silent = self._heard is not None and now - self._heard_at > SILENT_S
        if silent:
            self._heard = None
            self._observed.forget()
            self._tell(LinkLost())
        if self._transaction is not None:
            condition = self._observed.condition(now)
            if self._in_flight or (self.autopilot.flying and not self._flying_told):
                self._flying_told = self.autopilot.flying
                landed = not self.autopilot.flying
                self._tell(VehicleReport(condition.armed, ekf_healthy=True, landed=landed))
            return
        if self._heard is None or now < self._not_before:
            return
        condition = self._observed.condition(now)
        open_ones = self._journal.recover()
        if open_ones:
            if not moment(condition, UNDO):
                self.story.say("takes up what is open")
                self._begin(PushTransaction.resume(open_ones[0], system_id=1))
        elif not self._pushed and not moment(condition, SETTINGS):
            self._pushed = True
            self._in_flight = self.script.in_flight
            self.story.say("pushes")
            armed = self.script.in_flight
            self._begin(PushTransaction(self.plan, identifier="t1", system_id=1, allow_armed=armed))

    # The service

    def _start(self) -> None:
        """A new process on the same disk."""
        self._close()
        self._observed.forget()
        self._heard = self._armed_since = None
        self._seen_boots = self.autopilot.boots
        self._flying_told = False
        self._steps = 0
        self._step_limit = self._deaths.pop(0) if self._deaths else math.inf
        if self._disk_deaths:
            self.disk.dies_at = self.disk.operations + self._disk_deaths.pop(0)
        try:
            self._journal = Journal(self._path, limit_bytes=4000, keep=1)
        except StateError as error:
            self.story.say(f"does not start: {error}")
            return
        self._pushed = any(isinstance(e, Planned) for _, e in self._journal.entries)
        self._in_flight = False
        self.story.say("starts")

    def _close(self) -> None:
        if self._journal is not None:
            self._journal.close()
        self._journal = self._transaction = None

    def _guarded(self, what: Callable[[], object]) -> None:
        """Do it; if the service dies of it, it is started again some time later."""
        try:
            what()
        except KilledError:
            self.story.say("is killed")
            self._journal = self._transaction = None
            self.disk.release()
            self.disk.dies_at = None
            wait = self.rng.choice((0.1, 1.0, 3.0))
            self._not_before = self.agenda.now + wait

    def _begin(self, transaction: PushTransaction) -> None:
        self._transaction = transaction
        self._flying_told = False
        self._act(transaction.start(self.agenda.now))

    def _tell(self, event: TransactionEvent) -> None:
        if self._transaction is not None:
            self._act(self._transaction.feed(event, self.agenda.now))

    def _act(self, outputs: tuple[TransactionOutput, ...]) -> None:
        for output in outputs:
            self._steps += 1
            if self._steps > self._step_limit:
                raise KilledError
            if isinstance(output, Record):
                self._tell(self._append(output))
            elif isinstance(output, Finished):
                self._ended(output)
            else:
                self._check_sent(output)
                self.link.carry(output, self.autopilot.receive)

    def _append(self, record: Record) -> JournalWritten | JournalFailed:
        if self._journal is None:
            raise KilledError
        try:
            self._journal.append(record.entry, self.agenda.now)
        except StateError as error:
            self._journal.owe(record.entry, self.agenda.now)  # as the ledger does
            return JournalFailed(str(error))
        return JournalWritten()

    def _ended(self, finished: Finished) -> None:
        outcome = finished.outcome
        self._transaction = None
        self._in_flight = False
        self._not_before = self.agenda.now + PAUSE_S
        self.story.say(f"{outcome.result.value}: {outcome.sentence} (left {outcome.left})")
        if outcome.result is Result.COMPLETED:
            self.rules.six(self.plan.wanted, "it says completed")
        elif outcome.result is Result.ROLLED_BACK:
            self.rules.six(self.plan.before, "it says rolled back")

    def _hear(self, event: TransactionEvent) -> None:
        """A packet has come from the vehicle."""
        if self._journal is None:
            return
        now = self.agenda.now
        if isinstance(event, Heartbeat):
            said = now - event.late
            self._heard, self._heard_at = (said, event.armed), now
            if not event.armed:
                self._armed_since = None
            elif self._armed_since is None:
                self._armed_since = said
            self._observed.feed(VehicleState(said, armed=event.armed), said)
            self._observed.feed(VehicleState(said, landed=not self.autopilot.flying), said)
            if self._seen_boots != self.autopilot.boots and self.rng.random() < 0.8:
                self._guarded(lambda: self._tell(Rebooted()))
                self._observed.forget()
            self._seen_boots = self.autopilot.boots
        self._guarded(lambda: self._tell(event))

    def _calm(self) -> None:
        self.mishaps.end()
        self._deaths.clear()
        self._disk_deaths.clear()
        self._step_limit = math.inf

    def _check_sent(self, output: SendAction) -> None:
        self.rules.sent(
            output, self._journal, self._heard, self._armed_since, in_flight=self._in_flight
        )

    def _audit(self) -> None:
        """After a boot of the autopilot, as the service does it: is it still there?"""
        if self._journal is None:
            return
        self.autopilot.reboot(0.0)
        completed = self._journal.last_completed(self.plan.imu)
        recovery = completed and audit(completed, self.autopilot.ram)
        if completed and not recovery and self.autopilot.lost and self.autopilot.touched:
            # What was lost with the power is found out, but where a person has set values since
            # nothing is touched any more.
            self.autopilot.touched.update(self.plan.names)
        if recovery:
            self.story.say("is taken back, for it was not stored")
            self._observed.feed(VehicleState(self.agenda.now, armed=False), self.agenda.now)
            self._begin(PushTransaction.resume(recovery, system_id=1))
            while self._transaction is not None:
                self._advance()


def _plan(script: Script) -> PushPlan:
    old, new = script.offsets
    quantum = script.quantum
    before = [float32(v) for v in (*SCALES[0], *old)]
    wanted = [float32(v + 3e-7 if quantum else v) for v in (*SCALES[1], *new)]
    changes = tuple(
        Change(name, b, w, -3.5, 3.5, 0.001)
        for name, b, w in zip(parameter_names(1).six, before, wanted, strict=True)
    )
    return PushPlan(Vehicle(1, DEVICE), 1, changes, Baseline(2.0, 1.0, 0.5))
