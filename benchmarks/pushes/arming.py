"""How long after the vehicle armed values are written: ``python -m benchmarks.pushes.arming``.

Pushes of the simulation, each armed at any moment of it; largest times of all, s.  A value counts
when it is sent and when it comes to be in force, whichever is later.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from dataclasses import replace
from pathlib import Path

from benchmarks.pushes.faults import OFFSETS, Fault, Script, Weather
from benchmarks.pushes.play import History
from onboard.mavlink.parameter_messages import SendAction, SendParamRead

BEGINS_S, ENDS_S = 2.5, 7.5
"""When a push without faults begins, and when it has ended."""
CALM = Weather(0.0, 0.0, 0.0, 0.0)
LINKS = {
    "5 to 20 ms each way, says at once that it armed": (CALM, "arm_says_so"),
    "the same, says so with its next heartbeat": (CALM, "arm"),
    "up to 200 ms each way, next heartbeat": (replace(CALM, late=1.0, latest=0.2), "arm"),
    "20 % of all packets lost, next heartbeat": (replace(CALM, loss=0.2), "arm"),
}


class ArmedHistory(History):
    """Notes what is written after ``armed_at``."""

    def __init__(self, script: Script, folder: Path) -> None:
        super().__init__(script, folder)
        self.armed_at = script.faults[0].at
        self.last_new = self.last_old = self.last_old_heard = 0.0
        self.sets = 0
        self.in_force = self.old_in_force = 0.0
        self.autopilot.changed = self._changed
        self._was = dict(self.autopilot.ram)

    def _check_sent(self, output: SendAction) -> None:
        super()._check_sent(output)
        if isinstance(output, SendParamRead):
            return
        now = self.agenda.now
        self.sets += 1
        if not self.armed_at <= now < self.armed_at + 6.0 or not self.autopilot.armed:
            return
        if output.value == self.plan.wanted[output.name] != self.plan.before[output.name]:
            self.last_new = now - self.armed_at
        else:
            self.last_old = now - self.armed_at
            if self._armed_since is not None:
                self.last_old_heard = now - self._armed_since

    def _changed(self) -> None:
        since = self.agenda.now - self.armed_at
        for name, value in self.autopilot.ram.items():
            if value == self._was.get(name):
                continue
            self._was[name] = value
            if since >= 0.0 and self.autopilot.armed and name in self.plan.names:
                if value == self.plan.wanted[name]:
                    self.in_force = since
                else:
                    self.old_in_force = since


def script(seed: int, weather: Weather, kind: str) -> Script:
    """A push that is armed somewhere in its middle."""
    at = random.Random(seed).uniform(BEGINS_S, ENDS_S)  # noqa: S311 - chance, no secret
    return Script(
        seed=seed, weather=weather, faults=(Fault(at, kind, duration=60.0),), in_flight=False,
        wrong_echo=0.0, quantum=0.0, store_delay=0.02, deaths=(), disk_deaths=(),
        offsets=OFFSETS[0],
    )  # fmt: skip


def main() -> None:
    """Play and print a table."""
    parser = argparse.ArgumentParser(prog="benchmarks.pushes.arming", description=__doc__)
    parser.add_argument("--count", type=int, default=400)
    count = parser.parse_args().count
    print("| link | new sent | new in force | old sent | old in force | old sent after heard |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (weather, kind) in LINKS.items():
            histories = [
                ArmedHistory(script(seed, weather, kind), Path(folder)) for seed in range(count)
            ]
            for history in histories:
                history.play()
            columns = ("last_new", "in_force", "last_old", "old_in_force", "last_old_heard")
            worst = (max(getattr(h, column) for h in histories) for column in columns)
            print(f"| {name} | {' | '.join(f'{w:.2f}' for w in worst)} |", flush=True)


if __name__ == "__main__":
    main()
