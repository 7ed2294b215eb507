"""Flying by itself: stands, arms, flies, lands, stands, and again."""

from __future__ import annotations

from dataclasses import dataclass

from sitl.builtin.autopilot import Autopilot

RETRY = 5.0
"""Between attempts to arm, s."""


@dataclass(slots=True)
class Mission:
    """So many flights of ``duration`` seconds with ``ground`` seconds on the ground before each.

    ``permitted`` is asked before every flight; a demonstration lets the next one begin only
    when the parameters have been pushed.
    """

    flights: int
    duration: float
    ground: float = 10.0
    flown: int = 0
    _ready_at: float | None = None
    _was_flying: bool = False

    def step(self, autopilot: Autopilot) -> None:
        """Does what is due; to be called a few times a second of simulated time."""
        flying = autopilot.flying
        if self._was_flying and not flying:
            self._ready_at = autopilot.clock + self.ground
        self._was_flying = flying
        if flying or self.flown >= self.flights:
            return
        if self._ready_at is None:
            self._ready_at = autopilot.clock + self.ground
        if autopilot.clock < self._ready_at:
            return
        if autopilot.arm():
            self._ready_at = autopilot.clock + RETRY
            return
        autopilot.take_off(self.duration)
        self.flown += 1
        self._was_flying = True
