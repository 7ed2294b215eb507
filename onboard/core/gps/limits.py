"""Every number of this room that decides something, with where it comes from.

Provenance in brackets: *physics*, *data sheet*, *cost* (more buys nothing), or *tuned* (on flights
of small aircraft: to be derived).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from onboard.core.gps.distrust import Distrust
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.samples import FIX_3D

RECOVERY: Final[Mapping[Distrust, float]] = MappingProxyType(
    {
        Distrust.SPOOFED: 30.0,  # a spoofer that lets go leaves the receiver's filter wrong
        Distrust.JAMMED: 10.0,  # loops re-acquire satellite by satellite
        Distrust.NO_FIX: 3.0,  # the first fixes after a loss are the worst
        Distrust.FEW_SATELLITES: 3.0,
        Distrust.HDOP: 3.0,
        Distrust.SPEED_ACCURACY: 3.0,
        Distrust.GPS_GLITCH: 5.0,  # a receiver's filter settles in some seconds after a slip
        Distrust.EKF_GPS_GLITCH: 5.0,
        Distrust.EKF_UNHEALTHY: 5.0,  # attitude needs seconds of aiding to become right again
        Distrust.STALE: 3.0,
        Distrust.LATE: 3.0,  # a link that has held fixes back does so again
        Distrust.GPS_GAP: 0.0,  # a lost packet says nothing about the receiver
        Distrust.RESTARTED: 0.0,
    }
)
"""Seconds that a reason is held after the report that denies it [tuned]."""
LATE_IN_A_ROW: Final = 5
"""So many fixes that are later than any link can make them are not late: one stamp before them was
far ahead [cost: a second at 5 Hz]."""
MOST_REFUSED_SPANS: Final = 512
"""Spans that are remembered: a receiver that flaps for hours must not fill the memory [cost]."""
GIVEN_UP_S: Final = 60.0
"""Another receiver's fixes, while there is none of the first, s: longer than a cold start differs
[data sheet]."""
LATE_SHARE: Final = 0.5
"""Share of the longest gap by which a fix may be behind the inertial samples when it comes: of a
gap that shows, most is then that, and no fix was missed [physics].  Once fixes are late, so much
less late they are in time again."""
STUCK_SHARE: Final = 0.5
"""Share of the longest gap for which repeats of an old fix must have come on: then the receiver has
stopped, not the link [cost]."""


@dataclass(frozen=True, slots=True)
class PlausibilityLimits:
    """Limits of a fix against the ones before it; healthy receivers reached none of them [tuned].

    Attributes:
        acceleration: m/s^2; velocity cannot change by more than ``jump + acceleration dt`` between
            fixes dt apart (healthy: up to 23 m/s^2 at 5 Hz), unless as much was felt.
        jump: m/s; see there.
        felt: what was felt counts so many times [physics: scales are off by a fifth at the most].
        baseline: s over which positions are compared with velocities.
        drift: m/s by which their mean velocities may differ (healthy: up to 1.3).
        drift_acceleration: m/s^2; more by so much times the longest step, for what happens between
            two fixes of a slow receiver.
        frozen_after: s of identical fixes that are too many.
        frozen_speed: m/s from which on they are.
    """

    acceleration: float = 30.0
    jump: float = 3.0
    felt: float = 1.2
    baseline: float = 1.0
    drift: float = 2.5
    drift_acceleration: float = 2.0
    frozen_after: float = 0.9
    frozen_speed: float = 2.0


@dataclass(frozen=True, slots=True)
class TrustLimits:
    """What a trustworthy fix has.

    Attributes:
        fix_type: at least; 3 is 3D [physics: height is needed].
        satellites: at least [data sheet: one more than a redundant solution needs].
        hdop: at most [tuned].
        speed_accuracy: at most, m/s, by the receiver's own word.  What it says is how much a fix
            weighs; of one that is worse, less than a hundredth of a usual one's [cost].
        gap: longest time between fixes, s.
        duration: s from the first opening on, after which the window ends for good; None: as long
            as GPS is there.
        plausibility: limits of a fix against the ones before it.
        recovery: s that a reason is held after the report that denies it.
    """

    fix_type: int = FIX_3D
    satellites: int = 6
    hdop: float = 2.5
    speed_accuracy: float = 5.0
    gap: float = LONGEST_FIX_GAP_S
    duration: float | None = None
    plausibility: PlausibilityLimits = field(default_factory=PlausibilityLimits)
    recovery: Mapping[Distrust, float] = field(default_factory=lambda: RECOVERY)

    def __deepcopy__(self, memo: object) -> TrustLimits:
        return self  # limits do not change
