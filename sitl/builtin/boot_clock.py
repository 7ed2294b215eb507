"""Time of the simulation and of the autopilot in it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class BootClock:
    """A clock that begins anew at every boot, and the time that has passed over all of them.

    Attributes:
        now: since the last boot, s.
        total: since the simulation began, over all reboots and times without power, s.
    """

    now: float = 0.0
    total: float = 0.0
    _booted_at: float = 0.0

    def boot(self) -> None:
        """Power on: the boot clock begins at zero."""
        self.now = 0.0
        self._booted_at = self.total

    def tick(self, now: float) -> None:
        """It is ``now`` on the boot clock."""
        self.now = now
        self.total = self._booted_at + now
