"""The boot clock as the inertial stream carries it, against which other stamps are judged."""

from __future__ import annotations

import math

from onboard.core.estimate.limits import AHEAD_OF_IMU_S, OTHER_CLOCK_S
from onboard.core.inputs.boot_time import NEXT_S, began_anew, far_ahead
from onboard.core.inputs.samples import AttitudeSample, ImuSample, Sample, Vibration


class StreamClock:
    """Newest and first time of the inertial samples, s on the boot clock."""

    __slots__ = ("_ahead", "_odd", "first", "newest")

    def __init__(self) -> None:
        self.newest = -math.inf
        self._odd: float | None = None
        self._ahead: float | None = None
        self.first = math.inf

    def hear(self, t: float) -> None:
        """An inertial sample has come."""
        self._ahead = None
        if t > self.newest:
            self.newest = t
            if self.first == math.inf:
                self.first = t

    def restart(self) -> float:
        """The clock begins anew; its last time before that."""
        ended, self.newest = self.newest, -math.inf
        self._odd = self._ahead = None
        return ended

    def refuses(self, sample: Sample) -> str | None:
        """Name of the reason why a sample's stamp is not believed; None: it is, or has none."""
        match sample:
            case ImuSample(t=t):
                return "imu_ahead" if self._leaps(t) else None
            case AttitudeSample(t=t):
                return "attitude_ahead" if self.is_ahead(t) else None
            case Vibration(t=t):
                return "vibration_ahead" if self.is_ahead(t) else None
            case _:
                return None

    def _leaps(self, t: float) -> bool:
        """True if this inertial stamp is far ahead of all others, and the one before is not.

        One alone is damage, and everything that follows it would be late.  After an outage the
        second is believed (or, of several accelerometers that are stamped alike, the first that is
        stamped later): the first is not known to be right.
        """
        before, self._ahead = self._ahead, t
        if not far_ahead(t, self.newest):
            return False
        return before is None or t == before or began_anew(t, before)

    def went_back(self, t: float) -> bool:
        """True if this inertial stamp and the one before say that the autopilot has started again.

        One alone is a packet that was very long on its way, or damage, and so is one that comes
        twice: see :class:`~onboard.core.inputs.boot_time.Boots`.
        """
        before, self._odd = self._odd, t if began_anew(t, self.newest) else None
        return self._odd is not None and before is not None and 0.0 < t - before <= NEXT_S

    def is_ahead(self, t: float) -> bool:
        """True for a stamp that the inertial stream is too far from reaching."""
        return math.isfinite(self.newest) and t - self.newest > AHEAD_OF_IMU_S

    def is_other(self, t: float) -> bool:
        """True for a stamp of another clock (another source, or garbage)."""
        return math.isfinite(self.newest) and abs(t - self.newest) > OTHER_CLOCK_S
