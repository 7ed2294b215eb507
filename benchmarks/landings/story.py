"""The story of some landings: plays chapters in a room, and writes down what really happened."""

from __future__ import annotations

import asyncio
import random
import tempfile
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

from benchmarks.landings.boards import Board, draw_boards
from benchmarks.landings.chapters import Chapter, Incident
from benchmarks.landings.checker import Checker, in_force
from benchmarks.landings.history import Approval, Flight, History
from benchmarks.landings.room import Room
from onboard.errors import RefusedError
from sitl.builtin.autopilot import Autopilot
from sitl.builtin.truth import Truth
from sitl.virtual_time import VirtualTimeLoop

FIRST_FIX_S = 30.0
"""Before the first flight: parameters are read, GPS becomes trusted."""
LOOP_HZ = 50
POLL_S = 1.0
QUICK_S = 0.05
"""For who wants to hit the half second that a push writes in."""
LONGEST_S = 600.0
DECIDED_S = 10.0
"""A person looks so often, and what was allowed has so long to happen."""
ARMED_S = 10.0
NUDGE_SCALE, NUDGE_OFFSET = 0.008, 0.08
"""What a ground station changes: plainly more than any estimate is uncertain by."""


@dataclass(slots=True, eq=False)
class Landed:
    """One line of the table: the flight, and what was held back after it (by name of reason)."""

    flight: Flight
    incidents: tuple[Incident, ...]
    held_back: Counter[str] = field(default_factory=Counter)


class Story:
    """Plays chapters; ``seed`` decides all chance in it, ``boards[0]`` is in the vehicle first."""

    def __init__(
        self, boards: tuple[Board, ...], directory: Path, *, seed: int, live: bool = False
    ) -> None:
        self.landings: list[Landed] = []
        self._boards = boards
        self._rng = random.Random(f"story {seed}")  # noqa: S311 - chance, no secret
        first = boards[0]
        truth = Truth(imus=first.imus, board=first.uid, seed=seed)
        self.autopilot = Autopilot(
            "plane", truth, parameters=first.stored, loop_rate=LOOP_HZ, longest=LONGEST_S
        )
        self.room = Room(self.autopilot, directory, seed=seed)
        self.history = History(first, live=live)
        self.checker = Checker(self.room, self.history, directory / "journal.jsonl")
        self.room.observer = self.checker
        self._needs_approval = False

    async def play(self, chapters: list[Chapter]) -> None:
        """Play all of it; must run on a virtual clock."""
        # A vehicle that fails would otherwise be waited for without end.
        async with asyncio.TaskGroup() as both:
            flying = both.create_task(self.room.fly(), name="vehicle")
            with self.room.fitted():
                self._say("the first board is " + self.history.board.name)
                self._powered()
                await self._start()
                await self._wait(FIRST_FIX_S)
                for chapter in chapters:
                    await self._chapter(chapter)
                await self.room.stop_daemon()
            flying.cancel()

    async def _chapter(self, chapter: Chapter) -> None:
        self._needs_approval = chapter.needs_approval
        for incident in chapter.incidents:
            self._say(incident.value)
            await self._happen(incident)
            await self._wait(chapter.pause_s)
            if chapter.approve:
                await self._approve()
                await self._wait(DECIDED_S)
        flight = await self._flight(chapter)
        landed = Landed(flight, chapter.incidents)
        self.landings.append(landed)
        await self._stand(chapter, landed)

    # Between flights

    async def _happen(self, incident: Incident) -> None:
        match incident:
            case Incident.RESTART | Incident.CRASH:
                await self._stop(crash=incident is Incident.CRASH)
                await self._wait(self._rng.uniform(1.0, 20.0))
                await self._start()
            case Incident.REBOOT:
                self._reseed()
                self._need(self.autopilot.power_cycle())
                self._powered()
            case Incident.POWER_CUT:
                self._reseed()
                off = self._rng.uniform(1.0, 15.0)
                self._need(self.autopilot.power_cycle(off=off))
                self._powered(off)
            case Incident.SWAP:
                self._swap(self._rng.uniform(1.0, 15.0))
            case Incident.SWAP_OFF:
                await self._stop()
                self._swap(self._rng.uniform(1.0, 15.0))
                await self._wait(20.0)
                await self._start()
            case Incident.BENCH:
                await self._stop()
                self._set(self.history.board.bench_calibration(self._rng))
                await self._wait(10.0)
                await self._start()
            case Incident.STATION:
                self._nudge()
            case Incident.ARMED:
                self.autopilot.arm(force=True)
                await self._wait(ARMED_S)
                await self._until_disarmed()

    def _swap(self, off: float) -> None:
        old = self.history.board
        old.stored = in_force(self.room)
        board = self._rng.choice([b for b in self._boards if b is not old])
        self._reseed()
        self._need(self.autopilot.swap_board(board.uid, board.imus, board.stored, off=off))
        self._say(f"board {old.name} is taken out, board {board.name} put in")
        self.history.board = board
        self.history.put_in = self.room.unix()
        self._powered(off)
        self.history.foreign.clear()
        self.history.set_by_other(self.room.unix(), board.stored)

    def _nudge(self) -> None:
        """A ground station changes one of the six of one accelerometer."""
        name = self._rng.choice(sorted(in_force(self.room)))
        step = NUDGE_SCALE if "SCAL" in name else NUDGE_OFFSET
        value = self.autopilot.parameters[name] + self._rng.choice((-1.0, 1.0)) * step
        self._set({name: value})

    def _set(self, values: dict[str, float]) -> None:
        """Somebody else sets parameters; every link hears of it."""
        now = self.autopilot.now
        for name, value in values.items():
            for answer in self.autopilot.parameters.set(now, name, value):
                self.autopilot.say(answer)
        self.history.set_by_other(self.room.unix(), values)
        self._say("set by somebody else: " + " ".join(f"{n}={v:.5g}" for n, v in values.items()))

    # Flying

    async def _flight(self, chapter: Chapter) -> Flight:
        if chapter.unseen:
            await self._stop()
        # What stands against it (two accelerometers that disagree) is no concern of the daemon's.
        self._need(not self.autopilot.arm(force=True))
        flight = Flight(
            len(self.history.flights) + 1,
            self.history.board,
            self.room.unix(),
            in_force(self.room),
        )
        self.history.flights.append(flight)
        self._say(f"flight {flight.number} on board {flight.board.name}: {chapter.flight_s:.0f} s")
        self._need(self.autopilot.take_off(chapter.flight_s))
        await self._wait(chapter.flight_s * 0.5)
        if chapter.disturb:
            self._nudge()
        if chapter.crash_aloft:
            self._say(Incident.CRASH.value + ", in flight")
            await self._stop(crash=True)
            await self._wait(5.0)
            await self._start()
        await self._until_disarmed()
        flight.landed = self.room.unix()
        self._say(f"flight {flight.number} has landed")
        while self.autopilot.flying:
            await self._wait(POLL_S)
        if self.room.service is None:
            await self._start()
        return flight

    async def _until_disarmed(self) -> None:
        while self.autopilot.armed:
            await self._wait(POLL_S)

    async def _stand(self, chapter: Chapter, landed: Landed) -> None:
        """After the landing: pushes, people, and other people."""
        end = self.room.clock() + chapter.stand_s
        meddle = chapter.meddle
        looks = self.room.clock() + DECIDED_S
        while self.room.clock() < end:
            await self._wait(QUICK_S if meddle else POLL_S)
            if meddle and self.checker.writing:
                await self._wait(self._rng.uniform(0.0, 0.4))
                self._say("a ground station meddles")
                self._nudge()
                meddle = False
            if chapter.approve and self.room.clock() >= looks:
                looks += DECIDED_S
                await self._approve()
        if self.room.service is not None:
            for proposal in self.room.service.snapshot().push.proposals:
                landed.held_back.update(proposal.held_back.keys())

    async def _approve(self) -> None:
        """A person approves what waits for it; not for a board that has not flown yet."""
        service, board = self.room.service, self.history.board
        if service is None or not self.history.flown:
            return
        for proposal in service.snapshot().push.proposals:
            try:
                await service.approve((proposal.imu,))
            except RefusedError:
                continue
            shown = {c.name: (c.before, c.after) for c in proposal.changes}
            now = self.room.unix()
            self.history.approvals.append(Approval(now, board, proposal.imu, shown))
            self._say(f"a person approves IMU {proposal.imu}")

    # Daemon and power

    async def _start(self) -> None:
        self.history.daemon_started = self.room.unix()
        await self.room.start_daemon(approval=self._needs_approval)
        self._say("the daemon starts" + (", approval needed" if self._needs_approval else ""))

    async def _stop(self, *, crash: bool = False) -> None:
        await self.room.stop_daemon(crash=crash)
        self.checker.look()
        self._say("the daemon " + ("crashes" if crash else "stops"))

    def _powered(self, off: float = 0.0) -> None:
        self.history.powered = self.room.unix() + off

    def _reseed(self) -> None:
        """The next boot flies another way, with other noise."""
        self.autopilot.truth = replace(self.autopilot.truth, seed=self._rng.randrange(10**6))

    async def _wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds)

    def _say(self, text: str) -> None:
        self.history.say(self.room.unix(), text)

    @staticmethod
    def _need(done: bool) -> None:  # noqa: FBT001 - what the simulator answered
        if not done:
            raise RuntimeError("the simulator refused")


def play(
    chapters: list[Chapter],
    *,
    seed: int,
    boards: int,
    imus: int,
    telling: bool = True,
    live: bool = False,
) -> Story:
    """Play chapters from the beginning, in a state directory of their own.

    Args:
        chapters: what happens.
        seed: of all chance.
        boards: how many there are of the model.
        imus: accelerometers of the model.
        telling: whether the boards tell their unique id.
        live: print the history as it happens.
    """

    async def played(directory: Path) -> Story:
        rng = random.Random(f"boards {seed}")  # noqa: S311 - chance, no secret
        model = draw_boards(rng, boards, imus, telling=telling)
        story = Story(model, directory, seed=seed, live=live)
        await story.play(chapters)
        return story

    with (
        tempfile.TemporaryDirectory() as folder,
        asyncio.Runner(loop_factory=VirtualTimeLoop) as runner,
    ):
        return runner.run(played(Path(folder)))
