"""Electric power: on, or off until a moment."""

from __future__ import annotations

from dataclasses import dataclass, field

from sitl.builtin.boot_clock import BootClock
from sitl.builtin.trajectory import Start


@dataclass(slots=True)
class Supply:
    """Whether there is power; time passes without it, too.

    Attributes:
        clock: the autopilot's.
        start: where the vehicle stands when power comes back.
    """

    clock: BootClock
    start: Start = field(default_factory=Start)
    _until: float | None = None

    @property
    def on(self) -> bool:
        """Whether the autopilot runs."""
        return self._until is None

    def cut(self, seconds: float, start: Start) -> None:
        """Power off for so long."""
        self._until = self.clock.total + seconds
        self.start = start

    def back_by(self, end: float) -> bool:
        """Lets time pass without power, until ``end`` at the latest; whether it is back then.

        Args:
            end: s since the simulation began.
        """
        if self._until is None:
            return True
        self.clock.total = min(self._until, end)
        return self.clock.total == self._until
