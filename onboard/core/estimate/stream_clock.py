"""The boot clock as the inertial stream carries it, against which other stamps are judged."""

from __future__ import annotations

import math

from onboard.core.estimate.limits import AHEAD_OF_IMU_S, OTHER_CLOCK_S
from onboard.core.inputs.boot_time import NEXT_S, began_anew


class StreamClock:
    """Newest and first time of the inertial samples, s on the boot clock."""

    __slots__ = ("_odd", "first", "newest")

    def __init__(self) -> None:
        self.newest = -math.inf
        self._odd: float | None = None
        self.first = math.inf

    def hear(self, t: float) -> None:
        """An inertial sample has come."""
        if t > self.newest:
            self.newest = t
            if self.first == math.inf:
                self.first = t

    def restart(self) -> float:
        """The clock begins anew; its last time before that."""
        ended, self.newest, self._odd = self.newest, -math.inf, None
        return ended

    def went_back(self, t: float) -> bool:
        """True if this inertial stamp and the one before say that the autopilot has started again.

        One alone is a packet that was very long on its way, or damage: see
        :class:`~onboard.core.inputs.boot_time.Boots`.
        """
        before, self._odd = self._odd, t if began_anew(t, self.newest) else None
        return self._odd is not None and before is not None and 0.0 <= t - before <= NEXT_S

    def is_ahead(self, t: float) -> bool:
        """True for a stamp that the inertial stream is too far from reaching."""
        return math.isfinite(self.newest) and t - self.newest > AHEAD_OF_IMU_S

    def is_other(self, t: float) -> bool:
        """True for a stamp of another clock (another source, or garbage)."""
        return math.isfinite(self.newest) and abs(t - self.newest) > OTHER_CLOCK_S
