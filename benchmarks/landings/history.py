"""What really happened: flights, starts, who set which parameter, what a person approved."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from benchmarks.landings.boards import Board
from benchmarks.landings.room import EPOCH

SAME_S = 30.0
"""A landing is told from another one by its time; two are never closer than this."""


@dataclass(slots=True, eq=False)
class Flight:
    """One flight; times are Unix times, ``in_force`` the calibration at take-off by name.

    ``disturbed``: a calibration was changed between take-off and landing.
    """

    number: int
    board: Board
    took_off: float
    in_force: dict[str, float]
    landed: float = 0.0
    disturbed: bool = False

    @property
    def seconds(self) -> float:
        """How long it was."""
        return self.landed - self.took_off


@dataclass(frozen=True, slots=True)
class Approval:
    """A person allowed what was shown for one accelerometer: (before, wanted) by name."""

    at: float
    board: Board
    imu: int
    shown: dict[str, tuple[float, float]]


@dataclass(slots=True)
class History:
    """Everything that the checker may know and the daemon may not."""

    board: Board
    flights: list[Flight] = field(default_factory=list)
    approvals: list[Approval] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    live: bool = False
    """Whether lines are printed as they come."""
    daemon_started: float = 0.0
    powered: float = 0.0
    put_in: float = 0.0
    """When the board that is there was put in."""
    foreign: dict[str, float] = field(default_factory=dict)
    """When somebody else gave a parameter the value that it has; what the daemon wrote is not
    in it."""

    def say(self, now: float, text: str) -> None:
        """A line for whoever has to understand a failure."""
        self.lines.append(f"{now - EPOCH:9.1f}  {text}")
        if self.live:
            print(self.lines[-1], flush=True)

    def set_by_other(self, now: float, changed: Iterable[str]) -> None:
        """Somebody else has changed these."""
        self.foreign |= dict.fromkeys(changed, now)
        if self.flights and not self.flights[-1].landed:
            self.flights[-1].disturbed = True

    @property
    def flown(self) -> bool:
        """Whether the board that is there has flown since it was put in."""
        return bool(self.flights) and self.flights[-1].took_off > self.put_in

    def landed_at(self, at: float) -> Flight | None:
        """The flight that landed then."""
        return next((f for f in self.flights if abs(f.landed - at) < SAME_S), None)

    def since_start(self) -> list[Flight]:
        """Flights on this board that ended since daemon and autopilot last started."""
        begun = max(self.daemon_started, self.powered)
        return [f for f in self.flights if f.board is self.board and f.landed > begun]
