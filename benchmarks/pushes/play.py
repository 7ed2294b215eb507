"""One history: a push, everything that goes wrong with it, and whether the rules held.

Real are the transaction, the policy, the journal and what observes the vehicle; link, autopilot,
disk and clock are simulated.  The rules:

1. In the end all six are old or all six are new, but for what somebody else has written, and the
   journal says which; nothing is left open.  (Where the autopilot's storage was full and somebody
   else has written a value since, nothing is promised: a person's values are not touched.)
2. Whenever a transaction says that it completed or was rolled back, that is so.
3. Under ``landed`` a new value leaves only within 1.5 s after a HEARTBEAT that said disarmed, and
   none after one that said armed; an old one not later than 2 s after that.
4. Nothing is written before the plan is on the disk, and nothing but the six.
5. Never are all three offsets zero, which ArduPilot takes for "never calibrated", where packets
   come once and in time, and nobody else writes.
"""

from __future__ import annotations

import math
import random
from functools import partial
from pathlib import Path

from benchmarks.pushes.disk import Disk, KilledError, journals_on
from benchmarks.pushes.faults import TURBULENCE_S, Fault, Script
from benchmarks.pushes.vehicle import Agenda, Autopilot, Link, float32
from onboard.core.inputs.samples import VehicleState
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.process.condition import Observed
from onboard.errors import StateError
from onboard.mavlink.parameter_messages import SendParamRead, SendParamSet
from onboard.push import limits
from onboard.push.entries import Closed, Planned, Result, audit
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


class BrokenRuleError(AssertionError):
    """A rule did not hold; the text says which, and when."""


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
        self.autopilot.changed = self._check_offsets
        self.disk = Disk(self.rng)
        self._path = folder / f"{script.seed}.jsonl"
        self._deaths = list(script.deaths)
        self._disk_deaths = list(script.disk_deaths)
        self._journal: Journal | None = None
        self._transaction: PushTransaction | None = None
        self._observed = Observed()
        self._heard: tuple[float, bool] | None = None
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
            self.agenda.at(fault.at, partial(self._happen, fault))
        self.agenda.at(TURBULENCE_S, self._calm)
        with journals_on(self.disk):
            try:
                self._guarded(self._start)
                self._tick()
                while not self._is_over():
                    self._advance()
                self._audit()
                self._judge_end()
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
            self._broken("it never comes to an end")

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
        silent = self._heard is not None and now - self._heard[0] > SILENT_S
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
                self._say("takes up what is open")
                self._begin(PushTransaction.resume(open_ones[0], system_id=1))
        elif not self._pushed and not moment(condition, SETTINGS):
            self._pushed = True
            self._in_flight = self.script.in_flight
            self._say("pushes")
            self._begin(
                PushTransaction(
                    self.plan,
                    identifier="t1",
                    system_id=1,
                    allow_armed=self.script.in_flight,
                )
            )

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
            self._say(f"does not start: {error}")
            return
        self._pushed = any(isinstance(e, Planned) for _, e in self._journal.entries)
        self._in_flight = False
        self._say("starts")

    def _close(self) -> None:
        if self._journal is not None:
            self._journal.close()
        self._journal = self._transaction = None

    def _guarded(self, what: object) -> None:
        """Do it; if the service dies of it, it is started again some time later."""
        try:
            what()  # type: ignore[operator]
        except KilledError:
            self._say("is killed")
            self._journal = self._transaction = None
            self.disk.release()
            self.disk.dies_at = None
            wait = self.rng.choice((0.1, 1.0, 3.0))
            self._not_before = self.agenda.now + wait

    def _begin(self, transaction: PushTransaction) -> None:
        self._transaction = transaction
        self._flying_told = False
        self._act(transaction.start(self.agenda.now))

    def _tell(self, event: object) -> None:
        if self._transaction is not None:
            self._act(self._transaction.feed(event, self.agenda.now))  # type: ignore[arg-type]

    def _act(self, outputs: tuple[object, ...]) -> None:
        for output in outputs:
            self._steps += 1
            if self._steps > self._step_limit:
                raise KilledError
            if isinstance(output, Record):
                self._tell(self._append(output))
            elif isinstance(output, Finished):
                self._ended(output)
            elif isinstance(output, SendParamRead | SendParamSet):
                self._check_sent(output)
                self.link.carry(output, self.autopilot.receive)

    def _append(self, record: Record) -> JournalWritten | JournalFailed:
        if self._journal is None:
            raise KilledError
        try:
            self._journal.append(record.entry, self.agenda.now)
        except StateError as error:
            return JournalFailed(str(error))
        return JournalWritten()

    def _ended(self, finished: Finished) -> None:
        outcome = finished.outcome
        self._transaction = None
        self._in_flight = False
        self._not_before = self.agenda.now + PAUSE_S
        self._say(f"{outcome.result.value}: {outcome.sentence} (left {outcome.left})")
        if outcome.result is Result.COMPLETED:
            self._check_six(self.plan.wanted, "it says completed")
        elif outcome.result is Result.ROLLED_BACK:
            self._check_six(self.plan.before, "it says rolled back")

    def _hear(self, event: object) -> None:
        """A packet has come from the vehicle."""
        if self._journal is None:
            return
        now = self.agenda.now
        if isinstance(event, Heartbeat):
            self._heard = (now, event.armed)
            if not event.armed:
                self._armed_since = None
            elif self._armed_since is None:
                self._armed_since = now
            self._observed.feed(VehicleState(now, armed=event.armed), now)
            self._observed.feed(VehicleState(now, landed=not self.autopilot.flying), now)
            if self._seen_boots != self.autopilot.boots and self.rng.random() < 0.8:
                self._guarded(lambda: self._tell(Rebooted()))
                self._observed.forget()
            self._seen_boots = self.autopilot.boots
        self._guarded(lambda: self._tell(event))

    # What goes wrong

    def _happen(self, fault: Fault) -> None:
        self._say(f"-- {fault.kind}")
        autopilot, end = self.autopilot, self.agenda.now + fault.duration
        name = self.plan.names[fault.name]
        match fault.kind:
            case "arm" | "arm_says_so" | "fly":
                autopilot.armed = True
                autopilot.flying = fault.kind == "fly"
                if fault.kind == "arm_says_so":
                    autopilot.beat_now()
                self.agenda.at(end, self._disarm)
            case "cut":
                self.link.cut = True
                self.agenda.at(end, lambda: setattr(self.link, "cut", False))
            case "silence":
                autopilot.silent_until = end
            case "reboot" | "quiet_reboot":
                autopilot.reboot(0.05 if fault.kind == "quiet_reboot" else 1.5)
            case "deny":
                autopilot.denied.add(name)
                self.agenda.at(end, autopilot.denied.clear)
            case "full_disk":
                self.disk.full = True
                self.agenda.at(end, lambda: setattr(self.disk, "full", False))
            case "full_storage":
                autopilot.full = True
                self.agenda.at(end, lambda: setattr(autopilot, "full", False))
            case "rival_sets":
                autopilot.touched.add(name)
                autopilot.set(name, autopilot.ram[name] + fault.value + 0.01)
            case "rival_restores":
                autopilot.touched.add(name)
                autopilot.set(name, (self.plan.before, self.plan.wanted)[fault.value > 0.5][name])
            case "rival_reads":
                for one in self.plan.names:
                    autopilot.receive(SendParamRead(one))

    def _disarm(self) -> None:
        self._say("-- disarms")
        self.autopilot.armed = self.autopilot.flying = False

    def _calm(self) -> None:
        """From here on nothing goes wrong any more."""
        self._say("-- calm")
        self._disarm()
        self.link.cut = False
        self.link.weather = type(self.script.weather)(0.0, 0.0, 0.0, 0.0)
        self.autopilot.denied.clear()
        self.autopilot.full = self.disk.full = False
        self.autopilot.wrong_echo = 0.0
        self._deaths.clear()
        self._disk_deaths.clear()
        self._step_limit = math.inf
        self.disk.dies_at = None

    # The rules

    def _check_sent(self, output: SendParamRead | SendParamSet) -> None:
        if isinstance(output, SendParamRead):
            return
        if output.name not in self.plan.names:
            self._broken(f"{output.name} is written")
        if self._journal is None or not any(
            isinstance(e, Planned) for _, e in self._journal.entries
        ):
            self._broken("written before the plan is on the disk")
        now, heard = self.agenda.now, self._heard
        new = output.value == self.plan.wanted[output.name]
        if new and output.value == self.plan.before[output.name]:
            return
        self._say(f"sets {output.name} {'new' if new else 'old'}")
        if self._in_flight:
            return
        if new and (heard is None or heard[1] or now - heard[0] > limits.FRESH_S + 1e-9):
            self._broken(f"a new value is sent, and the last HEARTBEAT was {heard}")
        late = self._armed_since is not None and now - self._armed_since > limits.ARMED_UNDO_S
        if not new and late:
            self._broken("an old value is sent long after it armed")

    def _check_offsets(self) -> None:
        weather, autopilot = self.script.weather, self.autopilot
        punctual = not (weather.late or weather.duplication or autopilot.boots)
        offsets = [autopilot.ram[name] for name in self.plan.names[3:]]
        if punctual and not autopilot.touched and not any(offsets):
            self._broken("all offsets are zero")

    def _check_six(self, target: dict[str, float], why: str) -> None:
        wrong = {
            name: (self.autopilot.ram[name], value)
            for name, value in target.items()
            if self.autopilot.ram[name] != value and name not in self.autopilot.touched
        }
        if wrong:
            self._broken(f"{why}, but (is, should be): {wrong}")

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
            self._say("is taken back, for it was not stored")
            self._observed.feed(VehicleState(self.agenda.now, armed=False), self.agenda.now)
            self._begin(PushTransaction.resume(recovery, system_id=1))
            while self._transaction is not None:
                self._advance()

    def _judge_end(self) -> None:
        if self._journal is None or self._journal.recover():
            self._broken("left open")
            return
        last = [e.result for _, e in self._journal.entries if isinstance(e, Closed)]
        completed = bool(last) and last[-1] is Result.COMPLETED
        self._check_six(
            self.plan.wanted if completed else self.plan.before,
            f"the journal says {'new' if completed else 'old'}",
        )

    def _say(self, text: str) -> None:
        self.lines.append(f"{self.agenda.now:8.3f} s  {text}")

    def _broken(self, what: str) -> None:
        story = "\n".join(self.lines)
        raise BrokenRuleError(f"{self.script}\n\n{story}\n{self.agenda.now:8.3f} s  RULE: {what}")


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
