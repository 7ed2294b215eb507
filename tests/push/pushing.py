"""A push in virtual time: autopilot, link, journal on disk and a process that can be killed."""

import math

from onboard.core.maths.accelerometer import parameter_names
from onboard.errors import StateError
from onboard.push.entries import Closed, Planned, Result, Undoing, Writing, audit
from onboard.push.journal import Journal
from onboard.push.limits import UNCHANGED
from onboard.push.plan import Baseline, Change, PushPlan, Vehicle
from onboard.push.signals import Finished, Heartbeat, JournalFailed, JournalWritten, Record
from onboard.push.transaction import PushTransaction
from tests.autopilot_parameters import Autopilot, Weather, World, accelerometer_parameters, float32

OLD = ((1.0, 1.0, 1.0), (0.02, -0.03, 0.04))
NEW = ((1.013, 0.988, 1.007), (0.15, -0.21, 0.08))
DEVICE = 3e6


def make_plan(old=OLD, new=NEW, imu=1, *, device=DEVICE, system_id=1, board=""):
    before = [float32(v) for v in (*old[0], *old[1])]
    wanted = [float32(v) for v in (*new[0], *new[1])]
    changes = tuple(
        Change(n, b, w, -3.5, 3.5, 0.001)
        for n, b, w in zip(parameter_names(imu).six, before, wanted, strict=True)
    )
    return PushPlan(Vehicle(system_id, device, board), imu, changes, Baseline(2.0, 1.0, 0.5))


class CrashError(Exception):
    """The daemon is killed here."""


class PushWorld(World):
    """Drives a transaction as the daemon does, and dies after ``life`` steps.

    A step is each output acted on and each journal entry made durable: a crash between
    any two of them is possible.
    """

    def __init__(self, path, plan=None, weather=None, seed=0, life=None, **autopilot):
        self.plan = plan or make_plan()
        parameters = accelerometer_parameters(self.plan.imu, device=DEVICE)
        parameters |= self.plan.before
        parameters |= {"FENCE_ENABLE": 0.0, "SYSID_THISMAV": 1.0}
        super().__init__(Autopilot(parameters, **autopilot), weather, seed)
        self.path = path
        self.life = life
        self.steps = 0
        self.journal = Journal(path)
        self.journal_broken_after = None
        self.eager = False
        self.armed = False
        self._next_beat = 0.1
        self.outcomes = []

    def handle(self, outputs):
        """As they come, and what a journal entry leads to either at once or after the rest."""
        queue = list(outputs)
        while queue:
            output = queue.pop(0)
            self._step()
            if isinstance(output, Record):
                reply = self._append(output.entry)
                self._step()
                if self.client is not None:
                    following = list(self.client.feed(reply, self.now))
                    queue = following + queue if self.eager else queue + following
            elif isinstance(output, Finished):
                self.outcomes.append(output.outcome)
                self.client = None
            else:
                self._check_rule_one(output)
                super().handle((output,))

    def _append(self, entry):
        broken = self.journal_broken_after
        if broken is not None and len(self.journal.entries) >= broken:
            return JournalFailed("disk full")
        try:
            self.journal.append(entry, self.now)
        except StateError as error:
            return JournalFailed(str(error))
        return JournalWritten()

    def _check_rule_one(self, output):
        if type(output).__name__ == "SendParamSet":
            assert output.name in self.plan.names
            on_disk = self.path.read_text()
            assert '"planned"' in on_disk, "a write left before the plan was durable"

    def _step(self):
        self.steps += 1
        if self.life is not None and self.steps > self.life:
            raise CrashError

    def beat_due(self):
        return math.inf if self.client is None else max(self._next_beat, self.now)

    def beat(self):
        self._next_beat = max(self._next_beat, self.now) + 1.0
        if self.now >= self.autopilot.silent_until:
            self.link.send(Heartbeat(self.armed), "us", self.now)

    def arm(self):
        """It arms, and says so with its next HEARTBEAT."""
        self.armed = True

    def push(self, **kwargs):
        kwargs.setdefault("system_id", 1)
        transaction = PushTransaction(self.plan, identifier="t1", **kwargs)
        self.plug(transaction)
        self.handle(transaction.start(self.now))
        return transaction

    def restart(self, torn=b"", system_id=1, wait=0.0):
        """A new process on the same disk; returns how many transactions it resumed."""
        self.client = None
        self.life = None
        self.journal_broken_after = None
        self.journal.close()
        if torn:
            with self.path.open("ab") as file:
                file.write(torn)
        self.run(until=self.now + wait)
        self.journal = Journal(self.path)
        open_ones = self.journal.recover()
        for recovery in open_ones:
            transaction = PushTransaction.resume(recovery, system_id=system_id)
            self.plug(transaction)
            self.handle(transaction.start(self.now))
            self.run(stop=lambda: self.client is None)
        return len(open_ones)

    def audit(self):
        """What the daemon does after a boot of the autopilot."""
        completed = self.journal.last_completed(self.plan.imu)
        recovery = completed and audit(completed, self.autopilot.ram)
        if recovery:
            transaction = PushTransaction.resume(recovery, system_id=1)
            self.plug(transaction)
            self.handle(transaction.start(self.now))
            self.run(stop=lambda: self.client is None)

    def run_through(self, **kwargs):
        """Push to the end (or to the crash); True if it got to the end."""
        try:
            self.push(**kwargs)
            self.run(stop=lambda: self.client is None)
        except CrashError:
            return False
        return True

    # What is true

    def holds(self):
        """'old', 'new' or 'mixed', in RAM and in storage alike."""
        found = []
        for store in (self.autopilot.ram, self.autopilot.stored):
            six = {n: store[n] for n in self.plan.names}
            if six == self.plan.before:
                found.append("old")
            elif six == self.plan.wanted:
                found.append("new")
            else:
                found.append("mixed")
        return found[0] if found[0] == found[1] else f"{found[0]}/{found[1]}"

    def journal_says(self):
        """'new' / 'old' by the last Closed entry, 'open', or 'old' where there is none."""
        last = None
        for _, entry in self.journal.entries:
            if isinstance(entry, Closed):
                last = "new" if entry.result is Result.COMPLETED else "old"
            elif isinstance(entry, Planned | Writing | Undoing):
                last = "open"
        return last or "old"

    def only_allowed_names_were_written(self):
        return {name for name, _ in self.autopilot.history} <= set(self.plan.names)


__all__ = ["NEW", "OLD", "CrashError", "PushWorld", "Weather", "make_plan"]


def finish(world, **kwargs):
    """The outcome of a push that ends, in which nothing forbidden was written."""
    assert world.run_through(**kwargs)
    (outcome,) = world.outcomes
    assert world.only_allowed_names_were_written()
    assert all(
        not all(abs(state[n]) < UNCHANGED for n in world.plan.names[3:])
        for state in world.autopilot.states
    )
    return outcome


def when_written(world, count, what):
    """Call ``what`` just after the autopilot has taken ``count`` writes."""
    original = world.autopilot.receive

    def receive(action, now):
        before = len(world.autopilot.history)
        original(action, now)
        if before < count <= len(world.autopilot.history):
            world.at(now, what)

    world.autopilot.receive = receive
