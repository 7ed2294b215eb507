"""The rules that every history of a push has to keep.

1. In the end all six are old or all six are new, but for what somebody else has written, and the
   journal says which; nothing is left open.  (Where the autopilot's storage was full and somebody
   else has written a value since, nothing is promised: a person's values are not touched.)
2. Whenever a transaction says that it completed or was rolled back, that is so.
3. Under ``landed`` a new value leaves only within 1.5 s after a HEARTBEAT that said disarmed was
   sent, and none after one that said armed; an old one not later than 2 s after either.
4. Nothing is written before the plan is on the disk, and nothing but the six.
5. Never are all three offsets zero, which ArduPilot takes for "never calibrated", where packets
   come once and in time, and nobody else writes.
"""

from __future__ import annotations

from benchmarks.pushes.faults import Script
from benchmarks.pushes.story import Story
from benchmarks.pushes.vehicle import Agenda, Autopilot
from onboard.mavlink.parameter_messages import SendAction, SendParamRead
from onboard.push import limits
from onboard.push.entries import Closed, Planned, Result
from onboard.push.journal import Journal
from onboard.push.plan import PushPlan


class Rules:
    """Holds what is sent and written against the rules; ``story`` ends where one is broken."""

    def __init__(
        self, script: Script, plan: PushPlan, agenda: Agenda, autopilot: Autopilot, story: Story
    ) -> None:
        self.story = story
        self._script, self._plan = script, plan
        self._agenda, self._autopilot = agenda, autopilot

    def sent(
        self,
        output: SendAction,
        journal: Journal | None,
        heard: tuple[float, bool] | None,
        armed_since: float | None,
        *,
        in_flight: bool,
    ) -> None:
        """What leaves for the autopilot.

        Args:
            output: it.
            journal: of the service.
            heard: when the last HEARTBEAT was sent, s, and whether it said armed.
            armed_since: when the first was sent that said so, s.
            in_flight: whether the push may write to an armed vehicle.
        """
        if isinstance(output, SendParamRead):
            return
        if output.name not in self._plan.names:
            self.story.broken(f"{output.name} is written")
        if journal is None or not any(isinstance(e, Planned) for _, e in journal.entries):
            self.story.broken("written before the plan is on the disk")
        now = self._agenda.now
        new = output.value == self._plan.wanted[output.name]
        if new and output.value == self._plan.before[output.name]:
            return
        self.story.say(f"sets {output.name} {'new' if new else 'old'}")
        if in_flight:
            return
        if new and (heard is None or heard[1] or now - heard[0] > limits.FRESH_S + 1e-9):
            self.story.broken(f"a new value is sent, and the last HEARTBEAT was {heard}")
        known = heard and heard[0] if armed_since is None else armed_since
        if not new and (known is None or now - known > limits.ARMED_UNDO_S + 1e-9):
            self.story.broken(f"an old value is sent, armed since {armed_since}, heard {heard}")

    def offsets(self) -> None:
        """A value has changed in the autopilot."""
        weather, autopilot = self._script.weather, self._autopilot
        held = autopilot.held_until > 0.0
        punctual = not (weather.late or weather.duplication or held or autopilot.boots)
        offsets = [autopilot.ram[name] for name in self._plan.names[3:]]
        if punctual and not autopilot.touched and not any(offsets):
            self.story.broken("all offsets are zero")

    def six(self, target: dict[str, float], why: str) -> None:
        """All six are what somebody says, but for those that somebody else has written."""
        wrong = {
            name: (self._autopilot.ram[name], value)
            for name, value in target.items()
            if self._autopilot.ram[name] != value and name not in self._autopilot.touched
        }
        if wrong:
            self.story.broken(f"{why}, but (is, should be): {wrong}")

    def end(self, journal: Journal | None) -> None:
        """Nothing is open, and the journal says which six there are."""
        if journal is None or journal.recover():
            self.story.broken("left open")
        last = [e.result for _, e in journal.entries if isinstance(e, Closed)]
        completed = bool(last) and last[-1] is Result.COMPLETED
        self.six(
            self._plan.wanted if completed else self._plan.before,
            f"the journal says {'new' if completed else 'old'}",
        )
