"""Arming, modes, and the flight from launch to disarming."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from sitl.builtin.boot_clock import BootClock
from sitl.builtin.params import Notice
from sitl.builtin.world import Piece, Vehicle, World

IDLE_DISARM = 10.0
Orders: TypeAlias = deque[Callable[[], object]]
"""What is done at the start of the next main loop."""


@dataclass(frozen=True, slots=True)
class Modes:
    """Custom mode numbers; ``stop`` end a flight, ``go`` begin one as soon as it is armed."""

    idle: int
    flying: int
    landing: int
    stop: tuple[int, ...]
    go: tuple[int, ...] = ()


MODES = {
    "copter": Modes(idle=0, flying=4, landing=9, stop=(6, 9)),
    "plane": Modes(idle=0, flying=10, landing=11, stop=(11, 20, 26), go=(13,)),
}


class FlightControl:
    """What the vehicle is told to do and does, from one boot to the next.

    Attributes:
        armed: whether motors may turn.
        mode: custom mode number.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        world: World,
        clock: BootClock,
        orders: Orders,
        *,
        say: Callable[[Notice], None],
        longest: float,
    ) -> None:
        """On the ground, disarmed.

        Args:
            vehicle: ``plane`` or ``copter``.
            world: in which it flies.
            clock: the autopilot's.
            orders: for the next main loop.
            say: tells all clients.
            longest: a flight without another duration ends by itself after so many seconds.
        """
        self.armed = False
        self.mode = MODES[vehicle].idle
        self._modes = MODES[vehicle]
        self._world = world
        self._clock = clock
        self._orders = orders
        self._say = say
        self._longest = longest
        self._armed_since = 0.0
        self._was_flying = False
        self._launching = False

    @property
    def flying(self) -> bool:
        """A flight is under way, from launch until it has disarmed."""
        pieces = (self._world.at(self._clock.now), self._world.pieces[-1])
        return self._launching or any(piece.flight is not None for piece in pieces)

    def arm(self, reasons: Sequence[str]) -> None:
        """Arms, unless there are reasons against it; STATUSTEXT says so."""
        for reason in reasons:
            self._say(Notice(f"Arm: {reason}", 2))
        if not reasons:
            self.armed = True
            self._armed_since = self._clock.now
            self._say(Notice("Arming motors", 6))
            if self.mode in self._modes.go:
                self.take_off()

    def disarm(self) -> bool:
        """Disarms; refused in the air."""
        piece = self._world.at(self._clock.now)
        if not piece.trajectory.landed[piece.index(self._clock.now)]:
            return False
        if self.armed:
            self.armed = False
            self._say(Notice("Disarming motors", 6))
        return True

    def take_off(self, duration: float | None = None) -> bool:
        """Starts a flight of about so many seconds, ground to ground; must be armed."""
        seconds = self._longest if duration is None else duration
        if not self.armed or self.flying:
            return False
        self._launching = True
        self._orders.append(lambda: self._launch(seconds))
        self.mode = self._modes.flying
        return True

    def land(self) -> bool:
        """Ends the flight early."""
        if not self.flying:
            return False
        self.mode = self._modes.landing
        self._orders.append(lambda: self._world.stop(self._clock.now))
        return True

    def _launch(self, duration: float) -> None:
        self._world.launch(self._clock.now, duration)
        self._launching = False

    def watch(self, piece: Piece) -> None:
        """Disarms after landing, or when nothing was done after arming.

        Args:
            piece: of the world under way.
        """
        row = piece.index(self._clock.now)
        flying = piece.flight is not None and bool(piece.trajectory.armed[row])
        if self._was_flying and not flying:
            self.mode = self._modes.idle
            self.disarm()
        self._was_flying = flying
        idle = self._clock.now - self._armed_since > IDLE_DISARM
        if self.armed and not self.flying and idle:
            self.disarm()

    def set_mode(self, mode: int) -> None:
        """A mode asked for by a client; those that come home end a flight."""
        if self.flying:
            if mode in self._modes.stop:
                self.land()
        else:
            self.mode = mode
