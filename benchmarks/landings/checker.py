"""The checker: holds what the daemon writes against what really happened.

1. Every write belongs to the board that is there, and is right within four claimed sigmas.
2. Every push has a flight that supports it: flown on this board since daemon and autopilot
   last started, with the values in force that the plan calls ``before``; or a person approved
   it.  The journal names that flight.
3. Nothing is written while armed.
4. What somebody else set is not overwritten without a new flight or a new approval.
5. No push begins before all accelerometers of its flight are diagnosed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.landings.boards import Board, names
from benchmarks.landings.history import Flight, History
from benchmarks.landings.room import Room

SIGMAS = 4.0
SCALE_FLOOR, OFFSET_FLOOR = 5e-4, 5e-3
"""What no sigma claims to know: the truth is that of the chip, which the simulated bias walk
(1e-4 m/s^2/sqrt(s)) carries off by 1e-3 m/s^2 in a flight, and the message counts in 0.01 m/s^2."""
UNHEARD_S = 1.5
"""A heartbeat a second tells of arming, and a change is announced when it is stored: what
happened less than this ago the daemon cannot know."""


@dataclass(slots=True)
class Push:
    """One transaction as the journal tells it, and what was true when it was planned."""

    transaction: str
    at: float
    board: Board
    imu: int
    purpose: str
    support: str
    writes: int = 0
    result: str = "open"


class Checker:
    """Observes a room; ``faults`` are sentences, each begins with the number of its rule."""

    def __init__(self, room: Room, history: History, journal: Path) -> None:
        self.faults: list[str] = []
        self.checked: Counter[int] = Counter()
        self.pushes: dict[str, Push] = {}
        self._room = room
        self._history = history
        self._journal = journal
        self._read = 0
        self._found: dict[int, float] = {}
        self._armed_since: float | None = None
        self._open: Push | None = None
        self._undoing = False

    @property
    def writing(self) -> bool:
        """Whether a push is under way that has begun to write."""
        return self._open is not None and self._open.writes > 0

    # What the room calls

    def look(self) -> None:
        """Read what has come to the journal, as long as everything is as it was then."""
        if self._room.failed:
            self._fault(0, "the daemon has ended by itself")
            self._room.raise_failure()
        armed = self._room.autopilot.armed
        if not armed:
            self._armed_since = None
        elif self._armed_since is None:
            self._armed_since = self._room.unix()
        if self._journal.exists() and self._journal.stat().st_size > self._read:
            with self._journal.open("rb") as file:
                file.seek(self._read)
                lines = file.read()
            self._read += len(lines)
            for line in lines.splitlines():
                told = msgspec.json.decode(line)
                self._entry(told["at"], told["entry"])

    def parameter_set(self, name: str, value: float) -> None:
        """The daemon writes a parameter."""
        now, push = self._room.unix(), self._open
        if push is None:
            self._fault(2, f"{name} = {value:.5g} is written outside of any push")
            return
        push.writes += 1
        self._expect(
            1,
            push.board is self._history.board,
            f"{name} = {value:.5g} is of board {push.board.name}, "
            f"board {self._history.board.name} is there",
        )
        since = self._armed_since
        self._expect(
            3,
            since is None or now - since < UNHEARD_S or self._undoing,
            f"{name} = {value:.5g} is written while armed",
        )
        changed = self._history.foreign.get(name)
        self._expect(
            4,
            changed is None
            or now - changed < UNHEARD_S
            or any(f.took_off > changed for f in self._history.since_start())
            or self._approved(push.imu, after=changed),
            f"{name} = {value:.5g} overwrites what somebody else set, "
            "and neither flight nor approval came since",
        )
        self._history.foreign.pop(name, None)

    # The journal

    def _entry(self, at: float, entry: Mapping[str, Any]) -> None:
        match entry["type"]:
            case "planned":
                self._planned(at, entry)
            case "found":
                self._found[entry["imu"]] = at
            case "writing" | "undoing":
                # An armed vehicle gets back what it had when it was armed.
                self._undoing = entry.get("undo", True)
                self._open = self.pushes.get(entry["transaction"])
            case "closed":
                push = self.pushes[entry["transaction"]]
                push.result = entry["result"]
                self._open = None if entry["result"] != "interrupted" else self._open
                self._history.say(at, f"push of IMU {push.imu}: {push.result} ({entry['reason']})")
            case _:
                pass

    def _planned(self, at: float, entry: Mapping[str, Any]) -> None:
        plan, board = entry["plan"], self._history.board
        imu, purpose = plan["imu"], entry.get("purpose", "push")
        push = Push(entry["transaction"], at, board, imu, purpose, self._named(entry))
        self.pushes[push.transaction] = self._open = push
        told = plan["vehicle"].get("board", "")
        self._expect(1, not told or told == board.uid, f"the plan is for board {told}")
        self._history.say(at, f"IMU {imu}: {purpose} planned, support: {push.support}")
        if purpose != "push":
            return
        before = {c["name"]: c["before"] for c in plan["changes"]}
        flights = [
            flight
            for flight in self._history.since_start()
            if not flight.disturbed and before.items() <= flight.in_force.items()
        ]
        approved = self._approved(imu, before=before)
        self._expect(
            2,
            approved or bool(flights),
            f"IMU {imu} is pushed, and no flight on board {board.name} since the last start, "
            "with the values in force, supports it",
        )
        self._expect(2, *self._names_its_flight(imu, entry, flights, approved=approved))
        if flights and not approved:
            waiting = [
                other
                for other in range(1, len(board.imus) + 1)
                if self._found.get(other, 0.0) < flights[-1].landed
            ]
            self._expect(5, not waiting, f"IMU {imu} is pushed, not yet diagnosed: IMU {waiting}")
        self._true(plan)

    def _names_its_flight(
        self, imu: int, entry: Mapping[str, Any], flights: list[Flight], *, approved: bool
    ) -> tuple[bool, str]:
        """Whether the journal names what supports the push, and rightly."""
        support = entry.get("support")
        if not support:
            return False, f"the push of IMU {imu} names no flight that supports it"
        if support["approved"]:
            return approved, f"the push of IMU {imu} is called approved, but nobody approved it"
        known = self._history.landed_at(support["landed_at"]) in flights
        right = support["board"] in {"", self._history.board.uid}
        return known and right, f"the flight that the push of IMU {imu} names does not support it"

    def _named(self, entry: Mapping[str, Any]) -> str:
        """What the journal says of the support of a push, in a word or two."""
        support = entry.get("support")
        if not support:
            return "not named"
        if support["approved"]:
            return "approved"
        flight = self._history.landed_at(support["landed_at"])
        return "unknown flight" if flight is None else f"flight {flight.number}"

    def _true(self, plan: Mapping[str, Any]) -> None:
        """The numbers that it claims to know, against the board that is there.

        Where it leaves a number as it is, the others are those that go best with the wrong one,
        not the true ones.
        """
        if any(change["kept"] for change in plan["changes"]):
            return
        truth = self._history.board.truth()
        for change in plan["changes"]:
            name = change["name"]
            floor = SCALE_FLOOR if "SCAL" in name else OFFSET_FLOOR
            error = change["wanted"] - truth[name]
            self._expect(
                1,
                abs(error) <= SIGMAS * change["sigma"] + floor,
                f"{name} = {change['wanted']:.5g}, sigma {change['sigma']:.2g}: "
                f"on board {self._history.board.name} {truth[name]:.5g} is true",
            )

    def _approved(
        self, imu: int, *, after: float = 0.0, before: Mapping[str, float] | None = None
    ) -> bool:
        """Whether a person allowed it on this board: of these values in force, or since then."""
        return any(
            approval.imu == imu
            and approval.board is self._history.board
            and approval.at > max(after, self._history.daemon_started)
            and (before is None or all(approval.shown[n][0] == v for n, v in before.items()))
            for approval in self._history.approvals
        )

    def _expect(self, rule: int, holds: bool, sentence: str) -> None:  # noqa: FBT001 - the outcome
        self.checked[rule] += 1
        if not holds:
            self._fault(rule, sentence)

    def _fault(self, rule: int, sentence: str) -> None:
        self.faults.append(f"({rule}) {sentence}")
        self._history.say(self._room.unix(), f"*** ({rule}) {sentence}")


def in_force(room: Room) -> dict[str, float]:
    """The calibration that the autopilot has, by name."""
    return {
        name: room.autopilot.parameters[name]
        for imu in range(1, len(room.autopilot.truth.imus) + 1)
        for name in names(imu)
    }
