"""Rolling is no flight, either, where nobody says what is: a plane's way to its runway and back.

On its wheels a vehicle is as low as where it stands, and gets there, or comes from there, without
having been higher in between.  So what is low is held back until it has come to a stand, which was
a landing, or has climbed again, which was flight; what is low after a stand is none.  A hover is
still, too: where the vehicle was lower before is no ground.
"""

from __future__ import annotations

import numpy as np

from onboard.core.inputs.limits import GROUND_M, LONGEST_ROLL_S, ROLLED_OUT_S, STILL_M_S
from onboard.core.inputs.segments import Fixes
from onboard.core.maths.arrays import Array, Mask


class Rolling:
    """Where the vehicle last stood, and whether it has flown since.

    Attributes:
        stood: height of the place, m; None before the first one.
        lowest: height of all there was, m.
        since: from when on it has been on the ground, s; None in flight.
    """

    __slots__ = ("lowest", "since", "stood")

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Another boot."""
        self.stood: float | None = None
        self.since: float | None = None
        self.lowest = np.inf

    def stands(self, t: Array, height: Array) -> None:
        """It was still at all of these times (n,), s, and heights (n,), m."""
        here = float(np.median(height))
        self.lowest = min(self.lowest, here)
        if here < self.lowest + GROUND_M:
            self.stood, self.since = here, float(t[-1])

    def flies(self) -> None:
        """Somebody says that it does."""
        self.since = None

    def held(self, t: Array, height: Array, speed: Array) -> float:
        """From when on it may be rolling, of which the end is not known yet; inf if it is not.

        Args:
            t: (n,) of the fixes that have come, s.
            height: (n,) m.
            speed: (n,) over ground, m/s.
        """
        low = self._low(height)
        flown = np.flatnonzero(~low)
        first = int(flown[-1]) + 1 if len(flown) else 0
        begun = len(flown) > 0 or self.since is None
        if not begun or first >= len(t) or _stopped(t[first:], speed[first:]):
            return np.inf
        start = float(t[first])
        return start if t[-1] - start < LONGEST_ROLL_S else np.inf

    def flight(self, fixes: Fixes) -> tuple[int, int]:
        """First and last (excluded) that were flight, now that what comes after them is known."""
        t, low = fixes.t, self._low(fixes.height)
        if self.since is not None:
            # Longer than any taxiing, it is a flight close to the ground.
            low &= t - self.since < LONGEST_ROLL_S
        flown = np.flatnonzero(~low)
        first, end = 0, len(t)
        if self.since is not None:
            first = int(flown[0]) if len(flown) else end
        after = int(flown[-1]) + 1 if len(flown) else 0
        if first < end:
            self.since = None
            speed = np.hypot(fixes.v_n[after:, 0], fixes.v_n[after:, 1])
            self.lowest = min(self.lowest, float(np.median(fixes.height[first:])))
            if _stopped(t[after:], speed):
                end = max(after, first)
                self.stands(t[after:], fixes.height[after:])
        return first, end

    def _low(self, height: Array) -> Mask:
        # No receiver finds the same height for seconds: one that has it does not measure it.
        if self.stood is None or len(height) == 0 or np.ptp(height) == 0.0:
            return np.zeros(len(height), dtype=bool)
        low: Mask = np.abs(height - self.stood) < GROUND_M
        return low


def _stopped(t: Array, speed: Array) -> bool:
    """Whether it has come to a stand by the end of these fixes."""
    if len(t) == 0 or t[-1] - t[0] < ROLLED_OUT_S:
        return False
    return bool(np.all(speed[t > t[-1] - ROLLED_OUT_S] < STILL_M_S))
