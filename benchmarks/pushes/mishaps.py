"""What goes wrong with a push, done to the autopilot, the link and the disk."""

from __future__ import annotations

from benchmarks.pushes.disk import Disk
from benchmarks.pushes.faults import Fault, Weather
from benchmarks.pushes.story import Story
from benchmarks.pushes.vehicle import Agenda, Autopilot, Link
from onboard.mavlink.parameter_messages import SendParamRead
from onboard.push.plan import PushPlan


class Mishaps:
    """The faults of a history."""

    def __init__(
        self,
        plan: PushPlan,
        agenda: Agenda,
        autopilot: Autopilot,
        link: Link,
        disk: Disk,
        story: Story,
    ) -> None:
        self._plan, self._agenda, self._story = plan, agenda, story
        self._autopilot, self._link, self._disk = autopilot, link, disk

    def happen(self, fault: Fault) -> None:
        """It goes wrong now."""
        self._story.say(f"-- {fault.kind}")
        autopilot, end = self._autopilot, self._agenda.now + fault.duration
        name = self._plan.names[fault.name]
        match fault.kind:
            case "arm" | "arm_says_so" | "fly":
                autopilot.armed = True
                autopilot.flying = fault.kind == "fly"
                if fault.kind == "arm_says_so":
                    autopilot.beat_now()
                self._agenda.at(end, self.disarm)
            case "cut":
                self._link.cut = True
                self._agenda.at(end, lambda: setattr(self._link, "cut", False))
            case "held_back":
                autopilot.held_until = max(autopilot.held_until, end)
            case "silence":
                autopilot.silent_until = end
            case "reboot" | "quiet_reboot":
                autopilot.reboot(0.05 if fault.kind == "quiet_reboot" else 1.5)
            case "deny":
                autopilot.denied.add(name)
                self._agenda.at(end, autopilot.denied.clear)
            case "full_disk":
                self._disk.full = True
                self._agenda.at(end, lambda: setattr(self._disk, "full", False))
            case "full_storage":
                autopilot.full = True
                self._agenda.at(end, lambda: setattr(autopilot, "full", False))
            case "rival_sets":
                autopilot.touched.add(name)
                autopilot.set(name, autopilot.ram[name] + fault.value + 0.01)
            case "rival_restores":
                autopilot.touched.add(name)
                autopilot.set(name, (self._plan.before, self._plan.wanted)[fault.value > 0.5][name])
            case "rival_reads":
                for one in self._plan.names:
                    autopilot.receive(SendParamRead(one))

    def disarm(self) -> None:
        """The vehicle is on the ground and disarmed."""
        self._story.say("-- disarms")
        self._autopilot.armed = self._autopilot.flying = False

    def end(self) -> None:
        """From here on nothing goes wrong any more."""
        self._story.say("-- calm")
        self.disarm()
        self._link.cut = False
        self._autopilot.held_until = self._agenda.now
        self._link.weather = Weather(0.0, 0.0, 0.0, 0.0)
        self._autopilot.denied.clear()
        self._autopilot.full = self._disk.full = False
        self._autopilot.wrong_echo = 0.0
        self._disk.dies_at = None
